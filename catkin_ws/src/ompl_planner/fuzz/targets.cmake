find_package(octomap REQUIRED)
fv_fuzz_core(planner_messages
  SOURCES ${PACKAGE}/src/node/conversions.cpp ${PACKAGE}/src/core/voxel_grid.cpp
  INCLUDES ${PACKAGE}/include ${PACKAGE}/src/core ${PACKAGE}/src/node ${FV_MESSAGES}
  LIBRARIES robot_core ${OCTOMAP_LIBRARIES} roscpp_serialization rostime)
fv_fuzz_target(ompl_planner map_message planner_messages)
fv_fuzz_target(ompl_planner plan_request planner_messages)
