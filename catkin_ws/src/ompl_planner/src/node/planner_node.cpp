/// Node of the planner: plan, execute, or both, on the shared map.
#include <ros/ros.h>

#include "action_servers.h"
#include "current_planner.h"
#include "execution.h"
#include "map_keeper.h"
#include "planning.h"
#include "robot_state.h"

namespace {

int runNode() {
  ros::NodeHandle nh;
  const auto params = ompl_planner::readNodeParams(nh, ros::NodeHandle("~"));
  ompl_planner::CurrentPlanner planner(
      nh, std::make_shared<ompl_planner::MotionPlanner>(params.model, params.rates, params.planner));
  ompl_planner::RobotState state(nh, params.model, params.node.joint_state_timeout_s);
  ompl_planner::MapKeeper maps(nh, planner, state);
  ompl_planner::Planning planning(planner, state, maps, params.node);
  ompl_planner::Execution execution(nh, planner, state, maps, params);
  maps.onPlaced([&planning](const ompl_planner::PlacedMap& map) { planning.warm(map); });
  planner.onChange([&maps] { maps.placeAgain(); });
  ompl_planner::ActionServers servers(nh, planning, execution);
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
