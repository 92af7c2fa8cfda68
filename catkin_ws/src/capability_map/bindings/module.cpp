#include "bindings.h"

namespace capability_map {

PYBIND11_MODULE(_core, m) {
  m.doc() = "Reachability spheres and queries. Lengths in m, angles in rad; the C++ library does the work.";
  pybind11::module_::import("fv_robot_model._core");  // RobotModel's Python type
  bindSpheres(m);
  bindShapes(m);
  bindQuery(m);
}

}  // namespace capability_map
