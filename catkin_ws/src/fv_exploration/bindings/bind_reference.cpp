// OctoMap's own insertion and plain loops, for tests and benchmarks to compare with.
#include <algorithm>
#include <chrono>
#include <tuple>
#include <unordered_map>

#include "bind_lanes.h"
#include "bindings.h"
#include "convex_hull.h"
#include "fv_exploration/evaluator.h"
#include "fv_exploration/utility.h"
#include "void_clusters.h"

namespace fv {

namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// An octomap::OcTree that scans are inserted into by OctoMap alone.
class ReferenceMap {
 public:
  explicit ReferenceMap(const MapConfig& c) : tree_(c.resolution_m) {
    tree_.setProbHit(c.prob_hit);
    tree_.setProbMiss(c.prob_miss);
    tree_.setClampingThresMin(c.clamp_min);
    tree_.setClampingThresMax(c.clamp_max);
    tree_.setOccupancyThres(c.occupancy_threshold);
  }
  /// @return seconds of insertPointCloud alone.
  double insert(const PointsF& points_map, const Eigen::Vector3f& origin, double max_range_m) {
    octomap::Pointcloud cloud;
    cloud.reserve(points_map.rows());
    for (Eigen::Index i = 0; i < points_map.rows(); ++i)
      cloud.push_back(points_map(i, 0), points_map(i, 1), points_map(i, 2));
    const auto start = Clock::now();
    tree_.insertPointCloud(cloud, {origin.x(), origin.y(), origin.z()}, max_range_m, false, false);
    return since(start);
  }
  /// Voxels whose class or log odds differ, of those that either map knows.
  int64_t differing(const OccupancyMap& map) const {
    return unmatched(tree_, map.tree()) + unmatched(map.tree(), tree_, true);
  }
  std::size_t memory() const { return tree_.memoryUsage(); }

 private:
  static int64_t unmatched(const octomap::OcTree& a, const octomap::OcTree& b, bool only_absent = false) {
    int64_t count = 0;
    for (auto leaf = a.begin_leafs(); leaf != a.end_leafs(); ++leaf) {
      const int edge = 1 << (16 - leaf.getDepth());
      const octomap::OcTreeKey low = leaf.getIndexKey();
      for (int i = 0; i < edge * edge * edge; ++i) {
        const octomap::OcTreeKey key(low[0] + i % edge, low[1] + i / edge % edge, low[2] + i / (edge * edge));
        const octomap::OcTreeNode* other = b.search(key);
        count += !other || (!only_absent && other->getLogOdds() != leaf->getLogOdds());
      }
    }
    return count;
  }
  octomap::OcTree tree_;
};

/// Algorithm 1 as one would write it first: one thread, the octree asked at each voxel, a hash map of sums.
py::tuple plainUtility(const Evaluator& e, double max_range_m) {
  const auto start = Clock::now();
  std::vector<Voxel> voxels;
  std::vector<int> clusters;
  e.frontier(voxels, clusters);
  std::unordered_map<uint64_t, double> sums;
  const OccupancyMap& map = e.map();
  const double range = max_range_m / map.resolution();
  int64_t visits = 0;
  const auto cast = [&](const Voxel& source, const Eigen::Vector3d& d, double u) {
    Voxel at = source;
    Eigen::Vector3d delta = d.cwiseAbs().cwiseInverse(), t = 0.5 * delta;
    while (const octomap::OcTreeNode* node = map.tree().search(map.tree().key(at))) {
      if (map.tree().isNodeOccupied(node)) return;
      sums[voxelId(at)] += u;
      ++visits;
      int axis;
      if (t.minCoeff(&axis) > range) return;
      at[axis] += d[axis] > 0 ? 1 : -1;
      t[axis] += delta[axis];
    }
  };
  const std::vector<int>& neighbours = e.evaluation().neighbour_clusters;
  for (const FrontierVoid& fv : e.evaluation().frontier_voids) {
    const Ellipsoid& v = e.evaluation().ellipsoids[fv.ellipsoid];
    for (int corner = 0; corner < 7; ++corner) {
      Eigen::Vector3d c = v.center;
      if (corner > 0)
        c += (corner % 2 ? 1 : -1) * v.semi_axes[(corner - 1) / 2] * v.axes.col((corner - 1) / 2);
      for (std::size_t i = 0; i < voxels.size(); ++i) {
        if (!e.hull().contains(voxels[i])) continue;
        if (!std::binary_search(&neighbours[fv.first], neighbours.data() + fv.last, clusters[i])) continue;
        const Eigen::Vector3d away = map.centre(voxels[i]) - c;
        if (away.norm() > 0) cast(voxels[i], away / away.norm(), v.volume);
      }
    }
  }
  return py::make_tuple(since(start), visits, sums.size());
}

/// Merging as one would write it first: look at all neighbouring pairs for each merger.
py::tuple plainClusters(const Voxels& voxels, const EvaluationConfig& config, double resolution_m) {
  std::vector<Voxel> list;
  for (Eigen::Index i = 0; i < voxels.rows(); ++i) list.push_back(voxels.row(i));
  const ClusterRule rule{
      {resolution_m, config.literal_formula}, config.min_fit, config.seed, config.seed_share};
  const auto start = Clock::now();
  std::vector<int> labels;
  VoidGraph graph = seedEllipsoids(list, rule, labels);
  std::vector<std::pair<int, int>>& edges = graph.edges;
  while (true) {
    int best = -1;
    std::tuple<double, uint64_t, uint64_t> best_key;
    for (int i = 0; i < static_cast<int>(edges.size()); ++i) {
      const VoidNode *a = &graph.nodes[edges[i].first], *b = &graph.nodes[edges[i].second];
      if (a->id > b->id) std::swap(a, b);
      const std::tuple key(Moments::squaredDistance(a->moments, b->moments), a->id, b->id);
      if (best >= 0 && !(key < best_key)) continue;
      if (!rule.accepts(a->moments + b->moments)) continue;
      best = i;
      best_key = key;
    }
    if (best < 0) break;
    const auto [a, b] = edges[best];
    graph.nodes[a].moments += graph.nodes[b].moments;
    graph.nodes[a].id = std::min(graph.nodes[a].id, graph.nodes[b].id);
    graph.nodes[b].moments.n = 0;
    for (int& label : labels) label = label == b ? a : label;
    for (auto& [p, q] : edges) {
      p = p == b ? a : p;
      q = q == b ? a : q;
      if (p > q) std::swap(p, q);
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    edges.erase(std::remove_if(edges.begin(), edges.end(), [](const auto& e) { return e.first == e.second; }),
                edges.end());
  }
  return py::make_tuple(since(start), toArray(labels));
}

}  // namespace

void bindReference(py::module_& m) {
  py::module_ r = m.def_submodule("reference",
                                  "OctoMap's own insertion and plain loops: what the fast ones are held to.");
  py::class_<ReferenceMap>(r, "ReferenceMap", "octomap::OcTree, filled by OcTree::insertPointCloud.")
      .def(py::init<const MapConfig&>(), py::arg("config"))
      .def("insert", &ReferenceMap::insert, py::arg("points_map"), py::arg("origin"),
           py::arg("max_range_m") = -1.0,
           "Insert (N, 3) float32 points of the map frame; returns the seconds of insertPointCloud.")
      .def("differing", &ReferenceMap::differing, py::arg("map"), "Number of voxels whose log odds differ.")
      .def_property_readonly("octree_memory_bytes", &ReferenceMap::memory);
  r.def("plain_utility", &plainUtility, py::arg("evaluator"), py::arg("max_range_m"),
        "(seconds, voxel visits, voxels with utility) of Algorithm 1 on the octree, one thread.");
  r.def("plain_clusters", &plainClusters, py::arg("voxels"), py::arg("config"), py::arg("resolution_m"),
        "(seconds, labels (N,)) of merging by looking at all pairs each time.");
  bindLanes(r);
}

}  // namespace fv
