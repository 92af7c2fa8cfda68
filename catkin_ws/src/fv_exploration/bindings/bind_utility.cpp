#include <algorithm>
#include <cmath>
#include <sstream>

#include "bindings.h"
#include "utility_tree.h"

namespace fv {

namespace {

struct PyUtility {
  Utility data;
  PointsF points;
  double resolution_m;
};

PyUtility accumulate(const Evaluator& evaluator, double max_range_m, int64_t max_rays, int threads) {
  const py::gil_scoped_release released;
  PyUtility out{
      accumulateUtility(evaluator, max_range_m, max_rays, threads), {}, evaluator.map().resolution()};
  out.points = centres(evaluator.map(), out.data.voxels);
  return out;
}

void requireSameVoxels(const OccupancyMap& map, const PyUtility& u) {
  if (map.resolution() == u.resolution_m) return;
  std::ostringstream text;
  text << "resolution_m of the utility is " << u.resolution_m << "; valid: " << map.resolution()
       << ", that of the map";
  throw InputError(text.str());
}

PointsF directions(const PyUtility& u) {
  PointsF out(u.data.direction.size(), 3);
  for (std::size_t i = 0; i < u.data.direction.size(); ++i) out.row(i) = u.data.direction[i];
  return out;
}

py::array_t<int> best(const PyUtility& u, int count, double radius_m,
                      std::optional<py::array_t<bool>> allowed) {
  std::vector<uint8_t> mask;
  if (allowed) {
    if (allowed->ndim() != 1 || allowed->shape(0) != static_cast<py::ssize_t>(u.data.voxels.size()))
      throw InputError("allowed has another shape than utility; valid: (U,) bool");
    for (py::ssize_t i = 0; i < allowed->shape(0); ++i) mask.push_back(allowed->at(i));
  }
  require(count >= 0, "count", count, "0 or more");
  require(radius_m >= 0, "suppression_radius_m", radius_m, "0 or more");
  return toArray(bestViews(u.data, u.resolution_m, mask, count, radius_m));
}

constexpr double kMostVoxels = 1 << 27;

struct Leaf {
  Voxel voxel;
  double utility;
  Eigen::Vector3f direction;
};

std::vector<Leaf> leavesWithUtility(const UtilityOcTree& tree, const std::string& path) {
  std::vector<Leaf> out;
  double voxels = 0;  // a node near the root would stand for more of them than there is memory
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    if (leaf->utility != 0) voxels += std::pow(8.0, 16 - leaf.getDepth());
  if (voxels > kMostVoxels) {
    std::ostringstream text;
    text << path << ": has utility in " << voxels << " voxels; valid: at most " << kMostVoxels;
    throw MapFileError(text.str());
  }
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    if (leaf->utility == 0) continue;
    const int edge = 1 << (16 - leaf.getDepth());
    const octomap::OcTreeKey key = leaf.getIndexKey();
    for (int i = 0; i < edge * edge * edge; ++i)
      out.push_back({Voxel(key[0] + i % edge, key[1] + i / edge % edge, key[2] + i / (edge * edge)) -
                         Voxel::Constant(kKeyOffset),
                     leaf->utility, leaf->direction});
  }
  std::sort(out.begin(), out.end(),
            [](const Leaf& a, const Leaf& b) { return voxelId(a.voxel) < voxelId(b.voxel); });
  return out;
}

py::tuple readTree(const std::string& path) {
  const std::unique_ptr<UtilityOcTree> tree = readUtilityTree(path);
  const std::vector<Leaf> found = leavesWithUtility(*tree, path);
  PointsF points(found.size(), 3), direction(found.size(), 3);
  std::vector<double> utility;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Eigen::Vector3d voxel = found[i].voxel.cast<double>();
    points.row(i) = ((voxel.array() + 0.5) * tree->getResolution()).matrix().cast<float>();
    direction.row(i) = found[i].direction;
    utility.push_back(found[i].utility);
  }
  return py::make_tuple(points, toArray(utility), direction);
}

}  // namespace

void bindUtility(py::module_& m) {
  py::class_<PyUtility>(m, "Utility", "Utility of free voxels (thesis, Algorithm 1).")
      .def_readonly("points", &PyUtility::points, "(U, 3) float32 centres [m].")
      .def_property_readonly(
          "utility", [](const PyUtility& u) { return toArray(u.data.utility); },
          "(U,) float64 [m^3]: volumes of the ellipsoids whose rays pass.")
      .def_property_readonly("direction", &directions, "(U, 3) float32 unit: where to look from there.")
      .def_property_readonly("rays", [](const PyUtility& u) { return u.data.rays; })
      .def_property_readonly("visits", [](const PyUtility& u) { return u.data.visits; });
  m.def("accumulate_utility", &accumulate, py::arg("evaluator"), py::arg("max_range_m"),
        py::arg("max_rays") = 0, py::arg("threads") = 0,
        "Algorithm 1 on the evaluator's last update. Returns Utility; InputError unless max_range_m is "
        "positive.");
  m.def("best_views", &best, py::arg("utility"), py::arg("count"), py::arg("suppression_radius_m"),
        py::arg("allowed") = py::none(),
        "Non-maximum suppression: indices (K,) of at most count voxels of highest utility, best first, no "
        "two nearer\n"
        "than the radius. allowed (U,) bool, None: all.");
  m.def(
      "write_utility_tree",
      [](const OccupancyMap& map, const PyUtility& u, const std::string& path) {
        requireSameVoxels(map, u);
        writeUtilityTree(*utilityTree(map, u.data), path);
      },
      py::arg("map"), py::arg("utility"), py::arg("path"),
      "Write map and utility as a .ot file of tree type UtilityOcTree. MapFileError when it cannot be "
      "written.");
  m.def("read_utility_tree", &readTree, py::arg("path"),
        "(points (U, 3), utility (U,), direction (U, 3)) of the leaves with utility of a UtilityOcTree file, "
        "ascending with\n"
        "z, y, x. MapFileError for files that are truncated or foreign.");
  m.def(
      "write_color_tree",
      [](const OccupancyMap& map, const PyUtility& u, const std::string& path, bool obstacles) {
        requireSameVoxels(map, u);
        writeColorTree(map, u.data, obstacles, path);
      },
      py::arg("map"), py::arg("utility"), py::arg("path"), py::arg("with_obstacles") = true,
      "Write the utility as colours (.ot of a ColorOcTree) for octovis. MapFileError when it cannot be "
      "written.");
  // Evaluator.utility, beside the function, because that is where one looks for it.
  m.attr("Evaluator").attr("utility") =
      py::cpp_function(&accumulate, py::name("utility"), py::is_method(m.attr("Evaluator")),
                       py::arg("max_range_m"), py::arg("max_rays") = 0, py::arg("threads") = 0,
                       "Algorithm 1 on the last update; rays of max_range_m [m], all of them or about "
                       "max_rays. Returns Utility.");
}

}  // namespace fv
