#include "bindings.h"

namespace fv_robot_model {

namespace py = pybind11;

PYBIND11_MODULE(_core, m) {
  m.doc() =
      "URDF and SRDF as kinematics and collision geometry. Lengths in m, angles in rad, poses as (4, 4).";
  py::register_exception<ModelError>(m, "ModelError", PyExc_ValueError);
  py::register_exception<UnknownNameError>(m, "UnknownNameError", PyExc_ValueError);
  bindShapes(m);
  bindRobotModel(m);
  bindSelfCollision(m);
  bindSelfFilter(m);
  bindSpace(m);
  bindIk(m);
}

}  // namespace fv_robot_model
