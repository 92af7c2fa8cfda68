#include "bindings.h"

PYBIND11_MODULE(_core, m) {
  m.doc() =
      "Motion planning on an occupancy map, without ROS. SI units; rows first; map frame unless said "
      "otherwise.";
  ompl_planner::bindScenes(m);
  ompl_planner::bindTiming(m);
  ompl_planner::bindPlanner(m);
}
