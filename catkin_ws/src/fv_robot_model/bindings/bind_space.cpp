#include "bindings.h"
#include "body_voxels.h"
#include "fv_robot_model/sphere_cover.h"

namespace fv_robot_model {
namespace {

namespace py = pybind11;

Points bodyVoxelsAt(const RobotModel& model, const Eigen::VectorXd& q, double resolution_m, double padding_m,
                    const py::object& T_map_root) {
  const Eigen::Isometry3d T = T_map_root.is_none()
                                  ? Eigen::Isometry3d::Identity()
                                  : isometryFromArray(T_map_root.cast<Array>(), "T_map_root");
  const py::gil_scoped_release release;
  return bodyVoxels(model, model.forward(q), T, resolution_m, padding_m);
}

/// (S, 4): centre and radius of each ball.
Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> asRows(const Spheres& balls) {
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> rows(balls.size(), 4);
  for (std::size_t i = 0; i < balls.size(); ++i) rows.row(i) << balls[i].center.transpose(), balls[i].radius;
  return rows;
}

}  // namespace

void bindSpace(py::module_& m) {
  m.def("body_voxels", &bodyVoxelsAt, py::arg("model"), py::arg("q"), py::arg("resolution_m"),
        py::arg("padding_m") = 0.0, py::arg("T_map_root") = py::none(),
        "Centres (V, 3), map frame, of the voxels that meet the body at q (J,), grown by padding_m.\n"
        "Voxel k spans [k, k + 1) * resolution_m on each axis; ordered by x, y, z.");
  m.def(
      "sphere_cover",
      [](const RobotModel& model, const std::string& link, double max_radius_m) {
        return asRows(sphereCover(model, model.linkIndex(link), max_radius_m));
      },
      py::arg("model"), py::arg("link"), py::arg("max_radius_m"),
      "Balls (S, 4) as x, y, z, radius in the link's frame, whose union contains the link's shapes.");
  m.def(
      "sphere_cover",
      [](const Shape& shape, double max_radius_m) { return asRows(sphereCover(shape, max_radius_m)); },
      py::arg("shape"), py::arg("max_radius_m"), "The same for one shape, in the frame of its link.");
}

}  // namespace fv_robot_model
