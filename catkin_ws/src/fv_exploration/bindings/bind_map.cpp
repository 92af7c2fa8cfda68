#include <pybind11/operators.h>

#include "bindings.h"

namespace fv {

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Corner = std::optional<std::array<double, 3>>;

void bindConfigs(py::module_& m) {
  const MapConfig d;
  py::class_<MapConfig>(
      m, "MapConfig",
      "What an OccupancyMap is made with; probabilities as OctoMap's.\n\n"
      "bounds_min, bounds_max: corners of the exploration volume [m]; voxels whose centre lies in it are\n"
      "mapped, no others. None: the map grows as needed. threads 0: all cores. dense_limit_mb: largest\n"
      "grid that a scan's rays are marked in. InputError (ValueError) for values out of range.")
      .def(py::init([](double resolution_m, Corner bounds_min, Corner bounds_max, double prob_hit,
                       double prob_miss, double clamp_min, double clamp_max, double occupancy_threshold,
                       int threads, double dense_limit_mb) {
             MapConfig c{resolution_m, bounds_min, bounds_max,          prob_hit, prob_miss,
                         clamp_min,    clamp_max,  occupancy_threshold, threads,  dense_limit_mb};
             c.validate();
             return c;
           }),
           py::kw_only(), py::arg("resolution_m") = d.resolution_m, py::arg("bounds_min") = d.bounds_min,
           py::arg("bounds_max") = d.bounds_max, py::arg("prob_hit") = d.prob_hit,
           py::arg("prob_miss") = d.prob_miss, py::arg("clamp_min") = d.clamp_min,
           py::arg("clamp_max") = d.clamp_max, py::arg("occupancy_threshold") = d.occupancy_threshold,
           py::arg("threads") = d.threads, py::arg("dense_limit_mb") = d.dense_limit_mb)
      .def_readonly("resolution_m", &MapConfig::resolution_m)
      .def_readonly("bounds_min", &MapConfig::bounds_min)
      .def_readonly("bounds_max", &MapConfig::bounds_max)
      .def_readonly("prob_hit", &MapConfig::prob_hit)
      .def_readonly("prob_miss", &MapConfig::prob_miss)
      .def_readonly("clamp_min", &MapConfig::clamp_min)
      .def_readonly("clamp_max", &MapConfig::clamp_max)
      .def_readonly("occupancy_threshold", &MapConfig::occupancy_threshold)
      .def_readonly("threads", &MapConfig::threads)
      .def_readonly("dense_limit_mb", &MapConfig::dense_limit_mb);
  const ScanConfig s;
  py::class_<ScanConfig>(
      m, "ScanConfig",
      "Which returns of a scan count [m]: nearer than min_range_m are dropped, farther than max_range_m\n"
      "clear up to there; rays without return clear up to no_return_clear_m (0: they say nothing).")
      .def(py::init([](double min_range_m, double max_range_m, double no_return_clear_m) {
             ScanConfig c{min_range_m, max_range_m, no_return_clear_m};
             c.validate();
             return c;
           }),
           py::arg("min_range_m") = s.min_range_m, py::arg("max_range_m") = s.max_range_m,
           py::arg("no_return_clear_m") = s.no_return_clear_m)
      .def_readonly("min_range_m", &ScanConfig::min_range_m)
      .def_readonly("max_range_m", &ScanConfig::max_range_m)
      .def_readonly("no_return_clear_m", &ScanConfig::no_return_clear_m);
}

Class classNamed(const std::string& kind) {
  if (kind == "unknown") return kUnknown;
  if (kind == "free") return kFree;
  if (kind == "occupied") return kOccupied;
  throw InputError("kind is \"" + kind + "\"; valid: \"unknown\", \"free\", \"occupied\"");
}

py::array_t<int8_t> changedClasses(const InsertResult& r, bool after) {
  std::vector<int8_t> out;
  for (const Change& c : r.changes) out.push_back(static_cast<int8_t>((after ? c.after : c.before) - 1));
  return toArray(out);
}

void bindResult(py::module_& m) {
  py::class_<InsertResult>(m, "InsertResult", "What one change of the map did.")
      .def_property_readonly(
          "changed",
          [](const InsertResult& r) {
            Voxels out(r.changes.size(), 3);
            for (std::size_t i = 0; i < r.changes.size(); ++i) out.row(i) = r.changes[i].voxel;
            return out;
          },
          "(K, 3) int32 voxels whose class changed; a centre is (voxel + 0.5) * resolution_m.")
      .def_property_readonly(
          "before", [](const InsertResult& r) { return changedClasses(r, false); },
          "(K,) int8 class before: -1 unknown, 0 free, 1 occupied.")
      .def_property_readonly(
          "after", [](const InsertResult& r) { return changedClasses(r, true); }, "(K,) int8 class after.")
      .def_readonly(
          "counts", &InsertResult::counts,
          "Of a scan's points: points, dropped (made no ray), no_return, absurd (at ranges that no sensor "
          "sees),\n"
          "near; rays, of these hits, far (clear up to the largest range), outside (end beyond the octree's\n"
          "keys). Of voxels: free and occupied (marked so), changed.")
      .def_readonly("timings", &InsertResult::timings, "Seconds.")
      .def_readonly("sequence", &InsertResult::sequence, "Sequence number of the map afterwards.");
}

InsertResult insertScan(OccupancyMap& map, const Array& points, const Array& T, const ScanConfig& scan,
                        const std::optional<Array>& directions) {
  const Points p = toPoints(points, "points_sensor");
  const Points d = directions ? toPoints(*directions, "ray_directions") : Points(0, 3);
  const std::vector<Eigen::Matrix4d> transforms = toMatrices(T);
  if (transforms.size() != 1) throw InputError("T_map_sensor is a stack; valid: shape (4, 4)");
  const py::gil_scoped_release released;
  return map.insertScan(p, transforms[0], scan, d);
}

std::array<double, 3> boundsCorner(const OccupancyMap& map, bool max) {
  if (!map.bounded()) throw InputError("the map has no bounds; valid: a map with bounds_min and bounds_max");
  return max ? *map.config().bounds_max : *map.config().bounds_min;
}

void bindInput(py::class_<OccupancyMap>& c) {
  c.def(py::init<const MapConfig&>(), py::arg("config"))
      .def_static(
          "read",
          [](const std::string& path, const MapConfig* config) { return OccupancyMap::read(path, config); },
          py::arg("path"), py::arg("config") = nullptr,
          "Map of a .bt or .ot file of an OcTree. The config's resolution must be the file's, its bounds cut "
          "it.\n"
          "MapFileError (OSError) for files that are truncated or foreign; InputError for the resolution.")
      .def(
          "snapshot", [](const OccupancyMap& map) { return OccupancyMap(map); }, "A copy.")
      .def(
          "insert_scan", &insertScan, py::arg("points_sensor"), py::arg("T_map_sensor"),
          py::arg("scan") = ScanConfig{}, py::arg("ray_directions") = py::none(),
          "Insert a scan, as OctoMap's insertPointCloud(lazy_eval=False, discretize=False), cut to the "
          "bounds.\n\n"
          "points_sensor (N, 3) [m], sensor frame, not finite: no return. Ranges that no sensor sees (below\n"
          "NEAREST_RETURN_M, above FARTHEST_RETURN_M) are dropped. T_map_sensor (4, 4) rigid.\n"
          "ray_directions (N, 3), any length: where rows without return look; needed for no_return_clear_m.\n"
          "Returns InsertResult. InputError for wrong shapes or transforms, OutsideKeysError for a sensor "
          "where\n"
          "an octree of this resolution has no voxels; the map is as it was then.")
      .def(
          "mark_free",
          [](OccupancyMap& map, const Array& points) { return map.markFree(toPoints(points, "centres")); },
          py::arg("centres"),
          "Set the voxels of points (N, 3) [m] free, as certainly as clamping allows. Points outside are "
          "passed over.");
}

void bindQueries(py::class_<OccupancyMap>& c) {
  c.def(
       "classify",
       [](const OccupancyMap& map, const Array& points) {
         return toArray(map.classify(toPoints(points, "points")));
       },
       py::arg("points"),
       "(N,) int8 of points (N, 3) [m]: -1 unknown (or outside the bounds), 0 free, 1 occupied.")
      .def(
          "voxels", [](const OccupancyMap& map, const std::string& k) { return map.voxels(classNamed(k)); },
          py::arg("kind"),
          "(N, 3) float32 centres [m] at leaf resolution of all \"free\", \"occupied\" or (within bounds) "
          "\"unknown\" voxels.")
      .def(
          "counts",
          [](const OccupancyMap& map) {
            return std::map<std::string, int64_t>{{"free", map.count(kFree)},
                                                  {"occupied", map.count(kOccupied)},
                                                  {"unknown", map.count(kUnknown)}};
          },
          "Number of voxels of each class; unknown: within the bounds.")
      .def("known_share", &OccupancyMap::knownShare, "Known share of the bounded volume, 0 to 1.")
      .def("volume_m3", &OccupancyMap::volume, "Volume of the bounds' voxels [m^3].")
      .def_property_readonly("sequence", &OccupancyMap::sequence, "Grows by one with each change; 0: new.")
      .def_property_readonly("resolution_m", &OccupancyMap::resolution)
      .def_property_readonly("config", &OccupancyMap::config)
      .def_property_readonly("bounded", &OccupancyMap::bounded)
      .def_property_readonly("bounds_min", [](const OccupancyMap& map) { return boundsCorner(map, false); })
      .def_property_readonly("bounds_max", [](const OccupancyMap& map) { return boundsCorner(map, true); })
      .def_property_readonly("octree_memory_bytes",
                             [](const OccupancyMap& map) { return map.tree().memoryUsage(); });
}

void bindFiles(py::class_<OccupancyMap>& c) {
  c.def(
       "binary_data", [](const OccupancyMap& map) { return py::bytes(map.binaryData()); },
       "Payload of a binary octomap_msgs/Octomap: classes only.")
      .def(
          "full_data", [](const OccupancyMap& map) { return py::bytes(map.fullData()); },
          "Payload of a full octomap_msgs/Octomap: log odds.")
      .def("write_bt", &OccupancyMap::writeBt, py::arg("path"), "MapFileError when it cannot be written.")
      .def("write_ot", &OccupancyMap::writeOt, py::arg("path"), "MapFileError when it cannot be written.");
}

}  // namespace

void bindMap(py::module_& m) {
  bindConfigs(m);
  bindResult(m);
  py::class_<OccupancyMap> c(m, "OccupancyMap",
                             "The occupancy map: OctoMap's octree with a dense grid of classes beside it.");
  bindInput(c);
  bindQueries(c);
  bindFiles(c);
}

}  // namespace fv
