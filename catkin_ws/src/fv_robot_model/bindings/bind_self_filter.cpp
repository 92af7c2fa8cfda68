#include <algorithm>

#include "bindings.h"
#include "fv_robot_model/self_filter.h"

namespace fv_robot_model {
namespace {

namespace py = pybind11;

/// Python asks with joint values, so it keeps the model beside the filter.
struct PointFilter {
  RobotModel model;
  SelfFilter filter;
};

template <typename T>
py::array_t<std::uint8_t> toArray(const std::vector<T>& labels) {
  py::array_t<std::uint8_t> out(labels.size());
  std::transform(labels.begin(), labels.end(), out.mutable_data(),
                 [](T v) { return static_cast<std::uint8_t>(v); });
  return out;
}

py::array_t<std::uint8_t> classify(const PointFilter& self, const Eigen::Ref<const Points>& points,
                                   const Array& T_root_sensor, const Eigen::VectorXd& q) {
  const Eigen::Isometry3d T = isometryFromArray(T_root_sensor, "T_root_sensor");
  std::vector<PointClass> labels;
  {
    const py::gil_scoped_release release;
    labels = self.filter.classify(points, T, self.model.forward(q));
  }
  return toArray(labels);
}

py::array_t<bool> isRobot(const PointFilter& self, const Eigen::Ref<const Points>& points,
                          const Eigen::VectorXd& q) {
  std::vector<std::uint8_t> mask;
  {
    const py::gil_scoped_release release;
    mask = self.filter.isRobot(points, self.model.forward(q));
  }
  py::array_t<bool> out(mask.size());
  std::transform(mask.begin(), mask.end(), out.mutable_data(), [](std::uint8_t v) { return v != 0; });
  return out;
}

void bindConfig(py::module_& m) {
  using Links = std::map<std::string, LinkFilterConfig>;
  const LinkFilterConfig none;
  const SelfFilterConfig defaults;
  py::class_<LinkFilterConfig>(m, "LinkFilterConfig", "Exception for one link; None is as for the others.")
      .def(py::init([](std::optional<double> padding_m, std::optional<double> scale, bool ignore) {
             return LinkFilterConfig{padding_m, scale, ignore};
           }),
           py::arg("padding_m") = none.padding_m, py::arg("scale") = none.scale,
           py::arg("ignore") = none.ignore,
           "Unknown keys are a TypeError. ignore: this link removes nothing.")
      .def_readonly("padding_m", &LinkFilterConfig::padding_m, "m, or None.")
      .def_readonly("scale", &LinkFilterConfig::scale, "Factor, or None.")
      .def_readonly("ignore", &LinkFilterConfig::ignore, "True: this link removes nothing.");
  py::class_<SelfFilterConfig>(m, "SelfFilterConfig", "How generously the robot's own points are recognised.")
      .def(py::init([](double padding_m, double scale, double shadow_m, const Links& links) {
             return SelfFilterConfig{padding_m, scale, shadow_m, links};
           }),
           py::arg("padding_m") = defaults.padding_m, py::arg("scale") = defaults.scale,
           py::arg("shadow_m") = defaults.shadow_m, py::arg("links") = Links{},
           "Unknown keys are a TypeError.")
      .def_readonly("padding_m", &SelfFilterConfig::padding_m,
                    "Points up to this far outside a link are the robot's.")
      .def_readonly("scale", &SelfFilterConfig::scale,
                    "Factor on each shape about its own centre, before padding.")
      .def_readonly("shadow_m", &SelfFilterConfig::shadow_m,
                    "How far behind a padded link points are dropped.")
      .def_readonly("links", &SelfFilterConfig::links, "Exceptions: {link: LinkFilterConfig}.");
}

}  // namespace

void bindSelfFilter(py::module_& m) {
  py::enum_<PointClass>(m, "PointClass", "What a point of the depth camera is.", py::arithmetic())
      .value("SCENE", PointClass::Scene, "Something else than the robot.")
      .value("ROBOT", PointClass::Robot, "Within a padded link.")
      .value("SHADOW", PointClass::Shadow, "Its ray passed through a padded link just before.")
      .value("INVALID", PointClass::Invalid, "Not finite: no return.");
  bindConfig(m);
  py::class_<PointFilter> c(m, "SelfFilter", "Which points of a depth camera lie on the robot itself?");
  c.def(py::init([](const RobotModel& model, const SelfFilterConfig& config) {
          return PointFilter{model, SelfFilter(model, config)};
        }),
        py::arg("model"), py::arg("config") = SelfFilterConfig{});
  c.def("classify", &classify, py::arg("points_sensor"), py::arg("T_root_sensor"), py::arg("q"),
        "(N, 3) points in the sensor's frame, its pose (4, 4) in the root frame, q (J,) to (N,) uint8 of "
        "PointClass.");
  c.def("is_robot", &isRobot, py::arg("points_root"), py::arg("q"),
        "(N, 3) points in the root frame, q (J,) to (N,) bool: within a padded link. NaN is False.");
}

}  // namespace fv_robot_model
