#include <optional>

#include "bindings.h"
#include "fv_exploration/view_gain.h"
#include "return_chance.h"

namespace fv {

namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

std::vector<Eigen::Matrix4d> posesFrom(const Array<double>& poses) {
  return poses.size() ? toMatrices(poses) : std::vector<Eigen::Matrix4d>{};
}

/// The numbers of an array; none when there is no array. @throws InputError for an array without numbers.
std::vector<float> numbersFrom(const std::optional<Array<float>>& array, const char* name) {
  if (!array) return {};
  if (array->size() == 0)
    throw InputError(std::string(name) + " is empty; valid: one for each ray of each view, or None");
  return {array->data(), array->data() + array->size()};
}

void bindReturnChance(py::module_& m) {
  py::class_<ReturnChance>(
      m, "ReturnChance",
      "How likely rays of a camera are to come back, learned from the scans so far: a ray into the "
      "open shows nothing.")
      .def(py::init([](const Eigen::Vector3d& min, const Eigen::Vector3d& max, double cell_m,
                       const PinholeCamera& camera) { return ReturnChance(min, max, cell_m, camera); }),
           py::arg("bounds_min"), py::arg("bounds_max"), py::arg("cell_m"), py::arg("camera"),
           "Cells of edge cell_m [m] within the bounds, corners (3,) [m] of the map frame, and around them "
           "as far as "
           "the\ncamera sees.")
      .def(
          "note",
          [](ReturnChance& self, const Eigen::Matrix4d& T, const Array<double>& points,
             const std::optional<Array<bool>>& hidden) {
            const Points list = toPoints(points, "points_sensor");
            std::vector<uint8_t> mask;
            if (hidden) mask.assign(hidden->data(), hidden->data() + hidden->size());
            const py::gil_scoped_release released;
            self.note(T, list, mask);
          },
          py::arg("T_map_sensor"), py::arg("points_sensor"), py::arg("hidden") = py::none(),
          "Learn from a scan: points_sensor (N, 3) [m], optical frame. A pixel of the camera with a point in "
          "it came "
          "back\nfrom the nearest, others did not; hidden (R,) bool: the robot was in the way, which teaches "
          "nothing.")
      .def(
          "outlook",
          [](const ReturnChance& self, const Array<double>& poses, int stride, int threads) {
            const std::vector<Eigen::Matrix4d> list = posesFrom(poses);
            RayOutlook out;
            {
              const py::gil_scoped_release released;
              out = self.outlook(list, stride, threads);
            }
            const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(list.size()), self.rayCount()};
            return py::make_tuple(toArray(out.chance).reshape(shape), toArray(out.reach_m).reshape(shape));
          },
          py::arg("T_map_cameras"), py::arg("stride") = 1, py::arg("threads") = 0,
          "Of each ray of each view (V, 4, 4), (V, R) float32 each: the chance to come back from within the\n"
          "camera's range, and the length [m] at which a known surface ends what it can show. Of each\n"
          "stride x stride rays only one is followed.")
      .def_property_readonly("prior", &ReturnChance::prior,
                             "Share of the cells met for the first time that sent the ray back.");
}

}  // namespace

// long: a table of bindings
void bindGain(py::module_& m) {
  const PinholeCamera d;
  py::class_<PinholeCamera>(m, "PinholeCamera",
                            "A camera as rays, optical frame (z forward). Ranges [m] along the ray.")
      .def(py::init([](int width, int height, double horizontal, double vertical, double min, double max) {
             PinholeCamera c{width, height, horizontal, vertical, min, max};
             c.validate();
             return c;
           }),
           py::arg("width") = d.width, py::arg("height") = d.height,
           py::arg("horizontal_fov_rad") = d.horizontal_fov_rad,
           py::arg("vertical_fov_rad") = d.vertical_fov_rad, py::arg("min_range_m") = d.min_range_m,
           py::arg("max_range_m") = d.max_range_m)
      .def_readonly("width", &PinholeCamera::width)
      .def_readonly("height", &PinholeCamera::height)
      .def_readonly("horizontal_fov_rad", &PinholeCamera::horizontal_fov_rad)
      .def_readonly("vertical_fov_rad", &PinholeCamera::vertical_fov_rad)
      .def_readonly("min_range_m", &PinholeCamera::min_range_m)
      .def_readonly("max_range_m", &PinholeCamera::max_range_m)
      .def(
          "rays",
          [](const PinholeCamera& c, int stride) {
            require(stride >= 1, "stride", stride, "1 or more");
            const std::vector<Eigen::Vector3d> rays = c.rays(stride);
            Points out(rays.size(), 3);
            for (std::size_t i = 0; i < rays.size(); ++i) out.row(i) = rays[i];
            return out;
          },
          py::arg("stride") = 1, "(N, 3) unit directions, optical frame, row by row.");
  py::class_<ViewGains>(m, "ViewGains", "What views would show anew; arrays (V,).")
      .def_property_readonly("void_volume_m3", [](const ViewGains& g) { return toArray(g.void_volume_m3); })
      .def_property_readonly("unknown_volume_m3",
                             [](const ViewGains& g) { return toArray(g.unknown_volume_m3); })
      .def_property_readonly("frontier_area_m2",
                             [](const ViewGains& g) { return toArray(g.frontier_area_m2); })
      .def_property_readonly("occupied_share", [](const ViewGains& g) { return toArray(g.occupied_share); });
  m.def(
      "view_gain",
      [](const OccupancyMap& map, const Evaluator& evaluator, const Array<double>& poses,
         const PinholeCamera& camera, int stride, int threads, const std::optional<Array<float>>& chances,
         const std::optional<Array<float>>& reaches_m) {
        if (&evaluator.map() != &map)
          throw InputError("evaluator is of another map; valid: the evaluator of this map");
        const std::vector<Eigen::Matrix4d> list = posesFrom(poses);
        const RayOutlook outlook{numbersFrom(chances, "ray_chances"),
                                 numbersFrom(reaches_m, "ray_reaches_m")};
        const py::gil_scoped_release released;
        return viewGains(evaluator, list, camera, stride, threads, outlook);
      },
      py::arg("map"), py::arg("evaluator"), py::arg("T_map_cameras"), py::arg("camera"),
      py::arg("stride") = 1, py::arg("threads") = 0, py::arg("ray_chances") = py::none(),
      py::arg("ray_reaches_m") = py::none(),
      "Expected gain of views T_map_cameras (V, 4, 4) by ray casting on the evaluator's last update: every "
      "stride-th\n"
      "pixel is a ray, seen through free and unknown voxels up to an occupied one; each voxel counts once a "
      "view.\n"
      "ray_chances (V, R), 0 to 1: what a ray shows counts so much; ray_reaches_m (V, R): it is cast no "
      "farther; both "
      "are\nReturnChance.outlook's. None: every ray counts in full, as far as the camera sees.");
  bindReturnChance(m);
}

}  // namespace fv
