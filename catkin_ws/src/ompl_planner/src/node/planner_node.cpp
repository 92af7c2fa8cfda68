/// Node of the planner: the actions /ompl_planner/plan and /ompl_planner/execute on the shared map.
#include <ros/ros.h>

#include "execute_server.h"
#include "map_keeper.h"
#include "plan_server.h"
#include "robot_state.h"

namespace {

int runNode() {
  ros::NodeHandle nh;
  const auto params = ompl_planner::readNodeParams(nh, ros::NodeHandle("~"));
  const ompl_planner::MotionPlanner planner(params.model, params.rates, params.planner);
  ompl_planner::RobotState state(nh, params.model, params.node.joint_state_timeout_s);
  ompl_planner::MapKeeper maps(nh, planner, state);
  ompl_planner::PlanServer plan_server(nh, planner, state, maps, params.node);
  ompl_planner::ExecuteServer execute_server(nh, planner, state, maps, params);
  ros::AsyncSpinner spinner(3);  // last: its threads end before what they call
  spinner.start();
  ROS_INFO("ompl_planner is ready for robot '%s'", params.model->name().c_str());
  ros::waitForShutdown();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "ompl_planner");
  try {
    return runNode();
  } catch (const std::exception& error) {
    ROS_FATAL("ompl_planner: %s", error.what());
    return 1;
  }
}
