#include "bindings.h"
#include "sphere_builder.h"

namespace capability_map {
namespace {

namespace py = pybind11;

SphereGrid makeGrid(const Eigen::Vector3d& origin, double radius_m, const Eigen::Vector3i& size) {
  if (!origin.allFinite() || !(radius_m > 0.0) || !std::isfinite(radius_m) || (size.array() < 1).any()) {
    throw std::invalid_argument(
        "a grid needs a finite origin, a positive radius and at least one cell along each axis");
  }
  SphereGrid grid;
  grid.origin = origin;
  grid.radius_m = radius_m;
  grid.size = size;
  return grid;
}

Points centers(const SphereGrid& grid, const std::vector<int64_t>& cells) {
  Points out(static_cast<Eigen::Index>(cells.size()), 3);
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells[i] < 0 || cells[i] >= grid.cellCount())
      throw std::out_of_range("no cell " + std::to_string(cells[i]));
    out.row(static_cast<Eigen::Index>(i)) = grid.center(cells[i]);
  }
  return out;
}

template <typename T>
py::array_t<T> arrayOf(const std::vector<T>& values, py::ssize_t columns) {
  const auto rows = static_cast<py::ssize_t>(values.size()) / std::max<py::ssize_t>(1, columns);
  py::array_t<T> out({rows, columns});
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

py::dict build(ViewProbe& probe, const SphereGrid& grid, const Points& outward,
               const std::vector<int64_t>& cells) {
  SphereBatch batch;
  {
    const py::gil_scoped_release release;
    batch = buildSpheres(probe, grid, outward, cells);
  }
  py::dict out;
  out["valid"] = std::move(batch.valid);
  out["witnesses"] = arrayOf(batch.witnesses, probe.dof());
  out["manipulability"] =
      arrayOf(batch.manipulability, 1).reshape({static_cast<py::ssize_t>(batch.manipulability.size())});
  out["points_skipped"] = batch.points_skipped;
  out["ik_calls"] = batch.counts.ik_calls;
  out["collision_checks"] = batch.counts.collision_checks;
  return out;
}

/// (N, 3) positions and directions to (valid (N,), witnesses (N, dof), NaN where not valid).
py::tuple decideMany(ViewProbe& probe, const Points& positions, const Points& directions) {
  if (positions.rows() != directions.rows())
    throw std::invalid_argument("positions and directions differ in number");
  py::array_t<bool> valid(positions.rows());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> q(positions.rows(), probe.dof());
  q.setConstant(std::nan(""));
  bool* flags = valid.mutable_data();
  {
    const py::gil_scoped_release release;
    for (Eigen::Index i = 0; i < positions.rows(); ++i) {
      flags[i] = probe.decide(positions.row(i), directions.row(i), q.row(i).data()) >= 0.0;
    }
  }
  return py::make_tuple(valid, q);
}

void bindProbe(py::module_& m) {
  py::class_<ProbeOptions>(m, "ProbeOptions", "How a view is decided.")
      .def(py::init<>(), "Defaults.")
      .def_readwrite("roll_step_rad", &ProbeOptions::roll_step_rad, "Largest step between rolls [rad].")
      .def_readwrite("roll_search", &ProbeOptions::roll_search,
                     "Look between the steps where a limit was just missed.")
      .def_readwrite("self_collision", &ProbeOptions::self_collision, "Refuse self-collisions.")
      .def_readwrite("self_collision_padding_m", &ProbeOptions::self_collision_padding_m,
                     "Padding of links [m].")
      .def_readwrite("direction_tolerance_rad", &ProbeOptions::direction_tolerance_rad,
                     "Arms with fewer than 6 joints: how far z may miss [rad].")
      .def_readwrite("arm_angle_step_rad", &ProbeOptions::arm_angle_step_rad,
                     "Step of redundant angles [rad].");
  py::class_<ViewProbe>(m, "ViewProbe",
                        "Decides views by inverse kinematics and self-collision; one per thread.")
      .def(py::init<const fv_robot_model::RobotModel&, const std::string&, const ProbeOptions&>(),
           py::arg("model"), py::arg("group"), py::arg("options") = ProbeOptions(), py::keep_alive<1, 2>(),
           "For a group of a RobotModel that is a chain.")
      .def("decide", &decideMany, py::arg("positions"), py::arg("directions"),
           "Tip positions (N, 3) and z directions (N, 3), base frame, to (valid (N,), witnesses (N, dof), "
           "NaN where "
           "not valid).")
      .def_property_readonly("dof", &ViewProbe::dof, "Number of joints.")
      .def_property_readonly(
          "solver_name", [](const ViewProbe& p) { return p.solver().name(); },
          "Which inverse kinematics was chosen, and why.")
      .def_property_readonly(
          "solver_family", [](const ViewProbe& p) { return p.solver().family(); },
          "Short name of the inverse kinematics.")
      .def_property_readonly("last_joint_rolls_about_z", &ViewProbe::lastJointRollsAboutZ,
                             "True when one IK call stands for all rolls.");
}

}  // namespace

void bindSpheres(py::module_& m) {
  m.def("spiral_points", &spiralPoints, py::arg("n"), "(n, 3) nearly equally distributed unit vectors.");
  py::class_<SphereGrid>(m, "SphereGrid", "Cubic cells with one sphere each, base frame.")
      .def(py::init(&makeGrid), py::arg("origin"), py::arg("radius_m"), py::arg("size"),
           "Smallest corner (3,) [m], sphere radius [m], cells along x, y, z.")
      .def_readonly("origin", &SphereGrid::origin, "Smallest corner [m].")
      .def_readonly("radius_m", &SphereGrid::radius_m, "Radius of the spheres [m].")
      .def_readonly("size", &SphereGrid::size, "Cells along x, y, z.")
      .def_property_readonly("cell_count", &SphereGrid::cellCount, "Number of cells.")
      .def("centers", &centers, py::arg("cells"), "Cell numbers (C,) to sphere centers (C, 3) [m].");
  bindProbe(m);
  m.def("build_spheres", &build, py::arg("probe"), py::arg("grid"), py::arg("outward"), py::arg("cells"),
        "Decide the spheres of some cells: dict of valid (C, N) uint8, witnesses (V, dof), manipulability "
        "(V,), counts.");
  m.def(
      "cells_in_reach",
      [](const SphereGrid& grid, const Eigen::Vector3d& center, double radius_m) {
        return cellsInReach(grid, {center, radius_m});
      },
      py::arg("grid"), py::arg("center"), py::arg("radius_m"),
      "Cells with a sphere point within radius_m [m] of center: the others are out of reach, proven.");
}

}  // namespace capability_map
