#include "bindings.h"
#include "fv_robot_model/ik/group_solver.h"

namespace fv_robot_model {
namespace {

namespace py = pybind11;
using ik::ChainJoint;
using ik::IkOptions;
using ik::IkSolver;
using ik::SerialChain;
using RowMatrixX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Checks the shape only: IkSolver::solve checks the poses themselves and names the bad one.
std::vector<Eigen::Isometry3d> posesOf(const Array& matrices) {
  if (matrices.ndim() != 3 || matrices.shape(1) != 4 || matrices.shape(2) != 4) {
    throw std::invalid_argument("poses must have shape (N, 4, 4)");
  }
  std::vector<Eigen::Isometry3d> poses(static_cast<size_t>(matrices.shape(0)));
  for (size_t i = 0; i < poses.size(); ++i) {
    poses[i].matrix() =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrices.data() + 16 * i);
  }
  return poses;
}

SerialChain chainFromAxes(const RowMatrixX& axes, const RowMatrixX& points, const Eigen::VectorXd& lower,
                          const Eigen::VectorXd& upper, const Array& T_zero, std::vector<std::string> names) {
  const Eigen::Index n = axes.rows();
  const bool fits = axes.cols() == 3 && points.rows() == n && points.cols() == 3 && lower.size() == n &&
                    upper.size() == n && (names.empty() || static_cast<Eigen::Index>(names.size()) == n);
  if (!fits) throw std::invalid_argument("axes and points must be (n, 3), lower, upper and names (n,)");
  std::vector<ChainJoint> joints(static_cast<size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    ChainJoint& joint = joints[static_cast<size_t>(i)];
    joint.name = names.empty() ? "joint" + std::to_string(i + 1) : names[static_cast<size_t>(i)];
    joint.axis = axes.row(i);
    joint.point = points.row(i);
    joint.lower = lower[i];
    joint.upper = upper[i];
  }
  return SerialChain(std::move(joints), isometryFromArray(T_zero, "T_zero"));
}

Array forwardMany(const SerialChain& chain, const RowMatrixX& q) {
  if (q.cols() != chain.dof())
    throw std::invalid_argument("q must be (N, " + std::to_string(chain.dof()) + ")");
  Array out({static_cast<py::ssize_t>(q.rows()), py::ssize_t{4}, py::ssize_t{4}});
  for (Eigen::Index i = 0; i < q.rows(); ++i) {
    writeMatrix(chain.forward(q.data() + i * q.cols()), out.mutable_data() + 16 * i);
  }
  return out;
}

template <typename Member>
RowMatrixX vectorsOf(const SerialChain& chain, Member member) {
  RowMatrixX out(chain.dof(), 3);
  for (int i = 0; i < chain.dof(); ++i) out.row(i) = chain.joint(i).*member;
  return out;
}

Eigen::MatrixX2d limitsOf(const SerialChain& chain) {
  Eigen::MatrixX2d out(chain.dof(), 2);
  for (int i = 0; i < chain.dof(); ++i) out.row(i) << chain.joint(i).lower, chain.joint(i).upper;
  return out;
}

void bindChain(py::module_& m) {
  py::class_<SerialChain>(m, "SerialChain",
                          "Joint axes of a serial chain at zero, base frame (product of exponentials).")
      .def(py::init(&chainFromAxes), py::arg("axes"), py::arg("points"), py::arg("lower"), py::arg("upper"),
           py::arg("T_zero"), py::arg("names") = std::vector<std::string>{},
           "Revolute chain from axes (n, 3), points of them (n, 3) [m], limits (n,) [rad], T_base_tip (4, 4) "
           "at zero.")
      .def_static("of_group", &ik::chainOfGroup, py::arg("model"), py::arg("group"),
                  "The chain of a RobotModel's group, with its mimic joints; ModelError when it is none.")
      .def("forward", &forwardMany, py::arg("q"), "(N, n) joint values to T_base_tip (N, 4, 4).")
      .def(
          "reach_bound",
          [](const SerialChain& chain) {
            const ik::ReachBound bound = ik::reachBound(chain);
            return py::make_tuple(bound.center, bound.radius_m);
          },
          "(center (3,), radius [m]): a ball of the base frame that the tip never leaves; the radius is the "
          "arm's length.")
      .def_property_readonly("dof", &SerialChain::dof, "Number of joints.")
      .def_property_readonly("is_coupled", &SerialChain::isCoupled,
                             "True when mimic joints move along with the joints.")
      .def_property_readonly(
          "axes", [](const SerialChain& c) { return vectorsOf(c, &ChainJoint::axis); },
          "(n, 3) unit vectors at zero, base frame.")
      .def_property_readonly(
          "points", [](const SerialChain& c) { return vectorsOf(c, &ChainJoint::point); },
          "(n, 3) points of the axes at zero, base frame [m].")
      .def_property_readonly("limits", &limitsOf, "(n, 2) lower and upper [rad or m].")
      .def_property_readonly(
          "joint_names",
          [](const SerialChain& c) {
            std::vector<std::string> names;
            for (const ChainJoint& joint : c.joints()) names.push_back(joint.name);
            return names;
          },
          "Names, base first.")
      .def_property_readonly(
          "T_zero", [](const SerialChain& c) { return Eigen::Matrix4d(c.zeroPose().matrix()); },
          "T_base_tip (4, 4) at zero.")
      .def_property_readonly("base_frame", &SerialChain::baseFrame, "Frame of the poses.")
      .def_property_readonly("tip_frame", &SerialChain::tipFrame, "Frame that the poses place.");
}

void bindOptions(py::module_& m) {
  py::class_<IkOptions>(m, "IkOptions",
                        "Settings of the solvers; the C++ header says the unit and meaning of each.")
      .def(py::init<>(), "Defaults.")
      .def_readwrite("position_tolerance_m", &IkOptions::position_tolerance_m, "Residual by FK [m].")
      .def_readwrite("angle_tolerance_rad", &IkOptions::angle_tolerance_rad, "Residual by FK [rad].")
      .def_readwrite("limit_tolerance_rad", &IkOptions::limit_tolerance_rad, "Slack of the limits [rad].")
      .def_readwrite("sweep_step_rad", &IkOptions::sweep_step_rad, "Step of redundant angles [rad].")
      .def_readwrite("sweep_refinements", &IkOptions::sweep_refinements,
                     "One redundant joint: so often its step is quartered where nothing was found.")
      .def_readwrite("direction_tolerance_rad", &IkOptions::direction_tolerance_rad,
                     "Arms with fewer than 6 joints: how far the tip's z may miss [rad].")
      .def_readwrite("numerical_starts", &IkOptions::numerical_starts, "Numerical: starts per pose.")
      .def_readwrite("numerical_iterations", &IkOptions::numerical_iterations,
                     "Numerical: iterations per start.")
      .def_readwrite("numerical_seed", &IkOptions::numerical_seed, "Numerical: which starts.");
}

py::tuple solveMany(const IkSolver& solver, const Array& poses, const Eigen::MatrixXd& seeds) {
  const std::vector<Eigen::Isometry3d> T = posesOf(poses);
  ik::IkBatch batch;
  {
    const py::gil_scoped_release release;
    batch = solver.solve(T, seeds);
  }
  return py::make_tuple(
      py::array_t<int64_t>(static_cast<py::ssize_t>(batch.offsets.size()), batch.offsets.data()),
      py::cast(std::move(batch.joints)));
}

void bindSolver(py::module_& m) {
  py::class_<IkSolver>(m, "IkSolver", "All inverse kinematic solutions of a chain.")
      .def("solve", &solveMany, py::arg("poses"), py::arg("seeds") = Eigen::MatrixXd(),
           "T_base_tip (N, 4, 4) to (offsets (N + 1,) int64, joints (total, n)): the solutions of pose i are "
           "rows\n"
           "offsets[i]:offsets[i + 1]. With seeds (N, n) the nearest comes first. ValueError names a bad "
           "pose.")
      .def_property_readonly("chain", &IkSolver::chain, py::return_value_policy::reference_internal,
                             "Its chain.")
      .def_property_readonly("family", &IkSolver::family, "Short name of the method.")
      .def_property_readonly("name", &IkSolver::name, "What was chosen and why.")
      .def_property_readonly("exact", &IkSolver::exact,
                             "True when a pose that the arm can hold is never missed.")
      .def_property_readonly("numerical", &IkSolver::numerical,
                             "True when solutions are sought by iteration: tenths of a second a pose.");
  m.def("make_ik_solver", py::overload_cast<const SerialChain&, const IkOptions&>(&ik::makeIkSolver),
        py::arg("chain"), py::arg("options") = IkOptions(), "The best solver for a chain.");
  m.def("make_ik_solver",
        py::overload_cast<const RobotModel&, const std::string&, const IkOptions&>(&ik::makeIkSolver),
        py::arg("model"), py::arg("group"), py::arg("options") = IkOptions(), "The best solver for a group.");
  m.def("make_numerical_ik_solver", &ik::makeNumericalIkSolver, py::arg("chain"),
        py::arg("options") = IkOptions(), "KDL with several starts, whatever the chain.");
}

}  // namespace

void bindIk(py::module_& m) {
  bindChain(m);
  bindOptions(m);
  bindSolver(m);
}

}  // namespace fv_robot_model
