#include "bindings.h"
#include "fv_robot_model/self_collision.h"

namespace fv_robot_model {
namespace {

namespace py = pybind11;
using RowMatrixX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Python asks with joint values, so it keeps the model beside the checker.
struct CollisionChecker {
  RobotModel model;
  SelfCollision checker;
};

CollisionChecker make(const RobotModel& model, const std::optional<std::string>& group, double padding_m,
                      bool skip_adjacent) {
  const SelfCollisionConfig config{padding_m, skip_adjacent};
  return {model, group ? SelfCollision(model, model.group(*group), config) : SelfCollision(model, config)};
}

py::array_t<bool> inContact(const CollisionChecker& self, const Eigen::Ref<const RowMatrixX>& q) {
  py::array_t<bool> out(q.rows());
  bool* result = out.mutable_data();
  const py::gil_scoped_release release;
  LinkPoses poses;
  for (Eigen::Index b = 0; b < q.rows(); ++b) {
    self.model.forward(q.row(b).transpose(), poses);
    result[b] = self.checker.inContact(poses);
  }
  return out;
}

}  // namespace

void bindSelfCollision(py::module_& m) {
  py::class_<CollisionChecker> c(
      m, "SelfCollision", "Contact between links (FCL). Pairs that the SRDF disables are never checked.");
  c.def(py::init(&make), py::arg("model"), py::arg("group") = py::none(), py::arg("padding_m") = 0.0,
        py::arg("skip_adjacent") = true,
        "With a group: only pairs that its joints move against each other. Shapes grow by padding_m each.\n"
        "skip_adjacent leaves out links joined by one joint even when the SRDF does not list them.");
  c.def(
      "first_contact",
      [](const CollisionChecker& self, const Eigen::VectorXd& q) {
        return self.checker.firstContact(self.model.forward(q));
      },
      py::arg("q"), "(link, link) of the first contact at q (J,), or None.");
  c.def(
      "contacts",
      [](const CollisionChecker& self, const Eigen::VectorXd& q) {
        return self.checker.contacts(self.model.forward(q));
      },
      py::arg("q"), "All pairs in contact at q (J,).");
  c.def("in_contact", &inContact, py::arg("q"), "(B, J) configurations to (B,) bool.");
  c.def_property_readonly(
      "checked_pairs", [](const CollisionChecker& self) { return self.checker.checkedPairs(); },
      "Pairs of links that are checked.");
}

}  // namespace fv_robot_model
