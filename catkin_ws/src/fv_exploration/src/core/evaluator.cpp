#include "fv_exploration/evaluator.h"

#include <algorithm>
#include <chrono>
#include <numeric>

#include "parallel.h"
#include "void_join.h"

namespace fv {

namespace {

class Stopwatch {
 public:
  explicit Stopwatch(std::map<std::string, double>& timings) : timings_(timings) {}
  void lap(const char* name) {
    const auto now = std::chrono::steady_clock::now();
    timings_[name] = std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  std::map<std::string, double>& timings_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// List ellipsoids, largest count first, ties by index. @param fits nullptr: none there.
/// @return where each is in the list.
std::vector<int> listLargestFirst(const std::vector<const Ellipsoid*>& fits, std::vector<Ellipsoid>& out) {
  std::vector<std::pair<int64_t, int>> order;
  for (std::size_t i = 0; i < fits.size(); ++i)
    if (fits[i]) order.emplace_back(-fits[i]->count, static_cast<int>(i));
  std::sort(order.begin(), order.end());
  std::vector<int> rank(fits.size(), -1);
  out.reserve(order.size());
  for (const auto& [count, i] : order) {
    rank[i] = static_cast<int>(out.size());
    out.push_back(*fits[i]);
  }
  return rank;
}

/// The procedure of the thesis over all void voxels at once. @param[out] ellipsoids largest first.
/// @return by tile and label of its voids, as they are labelled then, the ellipsoid.
std::vector<std::vector<int>> clusterWhole(TileStore& tiles, const ClusterRule& rule,
                                           std::vector<Ellipsoid>& ellipsoids) {
  const std::vector<Voxel> voxels = tiles.voids();
  std::vector<int> labels;
  std::vector<Ellipsoid> fits;
  for (const VoidNode& node : clusterVoids(voxels, rule, labels).nodes)
    fits.push_back(fitEllipsoid(node.moments, rule.model));
  std::vector<const Ellipsoid*> all;
  for (const Ellipsoid& fit : fits) all.push_back(&fit);
  const std::vector<int> rank = listLargestFirst(all, ellipsoids);
  for (int& label : labels) label = rank[label];
  return tiles.relabelVoids(voxels, labels);
}

/// List the frontier clusters that each ellipsoid neighbours.
/// @param cluster_of by part. @param ellipsoid_of by node.
void pairFrontierVoids(const TileGroups& groups, const std::vector<int>& cluster_of,
                       const std::vector<int>& ellipsoid_of, Evaluation& out) {
  // Counted first, so that all lie in one list.
  std::vector<int> end(out.ellipsoids.size() + 1, 0);
  const auto forEachPair = [&](const auto& visit) {
    for (int g = 0; g < groups.count(); ++g) {
      const int *clusters = cluster_of.data() + groups.firstPart(g),
                *ellipsoids = ellipsoid_of.data() + groups.firstNode(g);
      for (const auto& [part, node] : groups.at(g).pairs) visit(ellipsoids[node], clusters[part]);
      for (const Across& link : groups.at(g).pairs_across)
        visit(ellipsoid_of[groups.nodeOf(link.tile, link.label)], clusters[link.own]);
    }
  };
  forEachPair([&](int ellipsoid, int) { ++end[ellipsoid + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<int> clusters(end.back());
  forEachPair([&](int ellipsoid, int cluster) { clusters[end[ellipsoid]++] = cluster; });
  auto begin = clusters.begin();
  for (std::size_t i = 0; i < out.ellipsoids.size(); ++i) {
    const auto finish = clusters.begin() + end[i];
    if (begin == finish) continue;
    std::sort(begin, finish);
    const int first = static_cast<int>(out.neighbour_clusters.size());
    out.neighbour_clusters.insert(out.neighbour_clusters.end(), begin, std::unique(begin, finish));
    out.frontier_voids.push_back(
        {static_cast<int>(i), first, static_cast<int>(out.neighbour_clusters.size())});
    begin = finish;
  }
}

}  // namespace

void EvaluationConfig::validate() const {
  require(min_fit > 0 && min_fit <= 1, "min_fit", min_fit, "above 0, at most 1");
  require(seed_share >= 0 && seed_share <= 1, "seed_share", seed_share, "0 to 1");
  require(threads >= 0 && threads <= 256, "threads", threads, "0 (all cores) to 256");
}

/// What is kept from one update to the next, in the order in which the parts are brought up to date: each
/// looks at those above it.
struct Evaluator::Parts {
  TileLayout layout;
  HullTracker hull;
  VoxelClasses classes;
  TileStore tiles;
  TileGroups groups;
  VoidJoin join;
  std::vector<int> cluster_of;    // by part of a group: its frontier cluster
  std::vector<int> ellipsoid_of;  // by node of a group

  Parts(const GridFrame& frame, const std::vector<uint8_t>& map_classes)
      : layout(frame), hull(frame), classes(map_classes, layout), tiles(layout), groups(layout) {}
  Parts(const Parts&) = delete;  // they refer to the layout

  /// Call visit(voxel, number) for each voxel of the frontiers or voids, tile by tile.
  template <class Number>
  void list(LabelledMask Tile::*part, std::vector<Voxel>& voxels, std::vector<int>& numbers,
            const Number& number) const {
    for (int t = 0; t < layout.count(); ++t)
      if (tiles.at(t))
        forEachLabel(tiles.at(t)->*part, layout.corner(t), [&](const Voxel& v, int label) {
          voxels.push_back(v);
          numbers.push_back(number(t, label));
        });
  }
};

Evaluator::Evaluator(const OccupancyMap& map, const EvaluationConfig& config)
    : map_(map), config_(config), parts_(std::make_unique<Parts>(GridFrame{}, std::vector<uint8_t>{})) {
  config_.validate();
}

Evaluator::~Evaluator() = default;

const Evaluation& Evaluator::update() {
  if (!(frame() == map_.frame())) parts_ = std::make_unique<Parts>(map_.frame(), map_.classes());
  Evaluation& out = nextEvaluation();
  Parts& p = *parts_;
  const int threads = threadCount(config_.threads);
  const ClusterRule rule = this->rule();
  const ClusterRule* const within = config_.tiled ? &rule : nullptr;  // merges within tiles, then groups
  Stopwatch watch(out.timings);

  VoxelClasses::Changes changes = p.classes.read(map_, p.hull, threads);
  p.hull.note(changes.ends, p.classes.flags());
  watch.lap("changes");
  // The hull beside the frontiers, which do not depend on it.
  p.tiles.refreshFrontiers(changes.frontiers, p.classes, map_.bounded(), threads,
                           [&] { p.hull.update(changes.voids); });
  watch.lap("hull_and_frontiers");
  p.tiles.refreshVoids(changes.voids, p.classes, p.hull.hull(), within, threads);
  std::vector<std::vector<int>> whole;
  if (!config_.tiled) whole = clusterWhole(p.tiles, rule, out.ellipsoids);
  watch.lap("voids");
  const std::vector<uint8_t> stale_groups = p.tiles.relink(threads);
  watch.lap("links");
  p.groups.refresh(stale_groups, p.tiles, within, threads);
  watch.lap("groups");
  out.clusters = p.groups.connectFrontiers(p.cluster_of);
  if (config_.tiled)
    joinVoids(rule, out);
  else
    takeWhole(whole);
  watch.lap("clusters");
  pairFrontierVoids(p.groups, p.cluster_of, p.ellipsoid_of, out);
  watch.lap("frontier_voids");

  out.counts["frontier"] = p.tiles.frontierVoxels();
  out.counts["void"] = p.tiles.voidVoxels();
  out.counts["tiles_stale"] = std::count(changes.frontiers.begin(), changes.frontiers.end(), 1);
  out.map_sequence = map_.sequence();
  return out;
}

/// A new result, with the memory of the one before the last when nobody looks at it any more.
Evaluation& Evaluator::nextEvaluation() {
  const int64_t number = evaluation_->update + 1;
  std::swap(evaluation_, spare_);
  if (evaluation_ && evaluation_.use_count() == 1)
    evaluation_->clear();
  else
    evaluation_ = std::make_shared<Evaluation>();
  evaluation_->update = number;
  return *evaluation_;
}

/// Merge voids across groups and number the clusters.
void Evaluator::joinVoids(const ClusterRule& rule, Evaluation& out) {
  Parts& p = *parts_;
  out.counts["merge_nodes"] = p.join.update(p.groups, rule);
  p.ellipsoid_of = listLargestFirst(p.join.fits(p.groups), out.ellipsoids);
  const std::vector<int>& leader = p.join.leader();
  for (std::size_t i = 0; i < leader.size(); ++i) p.ellipsoid_of[i] = p.ellipsoid_of[leader[i]];
}

/// @param whole by tile and label of its voids the ellipsoid.
void Evaluator::takeWhole(const std::vector<std::vector<int>>& whole) {
  Parts& p = *parts_;
  p.ellipsoid_of.resize(p.groups.nodes());
  for (std::size_t t = 0; t < whole.size(); ++t)
    for (std::size_t label = 0; label < whole[t].size(); ++label)
      p.ellipsoid_of[p.groups.nodeOf(static_cast<int>(t), static_cast<int>(label))] = whole[t][label];
}

ClusterRule Evaluator::rule() const {
  return {{map_.resolution(), config_.literal_formula}, config_.min_fit, config_.seed, config_.seed_share};
}

const HullRows& Evaluator::hull() const { return parts_->hull.hull(); }
const GridFrame& Evaluator::frame() const { return parts_->layout.frame; }
const std::vector<uint8_t>& Evaluator::flags() const { return parts_->classes.flags(); }

void Evaluator::frontier(std::vector<Voxel>& voxels, std::vector<int>& clusters) const {
  parts_->list(&Tile::frontier, voxels, clusters, [&](int tile, int component) {
    return parts_->cluster_of[parts_->groups.partOf(tile, component)];
  });
}

void Evaluator::voids(std::vector<Voxel>& voxels, std::vector<int>& ellipsoids) const {
  parts_->list(&Tile::voids, voxels, ellipsoids,
               [&](int tile, int label) { return parts_->ellipsoid_of[parts_->groups.nodeOf(tile, label)]; });
}

std::vector<Ellipsoid> Evaluator::initialEllipsoids() const {
  std::vector<Ellipsoid> out;
  std::vector<int> labels;
  const auto seed = [&](const std::vector<Voxel>& some) {
    for (const VoidNode& node : seedEllipsoids(some, rule(), labels).nodes)
      out.push_back(fitEllipsoid(node.moments, rule().model));
  };
  if (!config_.tiled) {
    seed(parts_->tiles.voids());
    return out;
  }
  for (int t = 0; t < parts_->layout.count(); ++t)
    if (const Tile* tile = parts_->tiles.at(t)) seed(maskVoxels(tile->voids.mask, parts_->layout.corner(t)));
  return out;
}

}  // namespace fv
