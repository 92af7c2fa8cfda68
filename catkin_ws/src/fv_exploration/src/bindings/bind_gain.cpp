#include "bindings.h"
#include "fv_exploration/view_gain.h"

namespace fv {

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
      [](const OccupancyMap& map, const Evaluator& evaluator,
         const py::array_t<double, py::array::c_style | py::array::forcecast>& poses,
         const PinholeCamera& camera, int stride, int threads) {
        if (&evaluator.map() != &map)
          throw InputError("evaluator is of another map; valid: the evaluator of this map");
        const std::vector<Eigen::Matrix4d> list =
            poses.size() ? toMatrices(poses) : std::vector<Eigen::Matrix4d>{};
        const py::gil_scoped_release released;
        return viewGains(evaluator, list, camera, stride, threads);
      },
      py::arg("map"), py::arg("evaluator"), py::arg("T_map_cameras"), py::arg("camera"),
      py::arg("stride") = 1, py::arg("threads") = 0,
      "Expected gain of views T_map_cameras (V, 4, 4) by ray casting on the evaluator's last update: every "
      "stride-th\n"
      "pixel is a ray, seen through free and unknown voxels up to an occupied one; each voxel counts once a "
      "view.");
}

}  // namespace fv
