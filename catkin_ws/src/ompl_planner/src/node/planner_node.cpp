/// Node of the planner: plan, execute, or both, on the shared map.
#include <ros/master.h>
#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>
#include <signal.h>
#include <unistd.h>

#include <ctime>

#include "action_servers.h"
#include "current_planner.h"
#include "execution.h"
#include "fv_common/last_resort.h"
#include "map_keeper.h"
#include "path_publisher.h"
#include "planning.h"
#include "robot_state.h"

namespace {

/// Ctrl-C, kill, and `rosnode kill`: kept from ending the process at once, for ROS must live until the arm
/// has stopped. Threads that begin later inherit this.
sigset_t holdEndSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

/// What roscpp binds here shuts ROS down at once.
void endBySignalOnMastersWord() {
  const auto on_shutdown = [](XmlRpc::XmlRpcValue&, XmlRpc::XmlRpcValue& answer) {
    kill(getpid(), SIGTERM);
    answer = ros::xmlrpc::responseInt(1, "", 0);
  };
  ros::XMLRPCManager::instance()->unbind("shutdown");
  ros::XMLRPCManager::instance()->bind("shutdown", on_shutdown);
}

/// Waits a tenth of a second for one.
bool endSignalled(const sigset_t& signals) {
  const timespec tenth{0, 100'000'000};
  return sigtimedwait(&signals, nullptr, &tenth) > 0;
}

/// roscpp would wait for it in a way that no signal ends. @return False when one came.
bool waitForMaster(const sigset_t& signals) {
  while (!ros::master::check()) {
    ROS_WARN_ONCE("ompl_planner waits for a ROS master at %s", ros::master::getURI().c_str());
    if (endSignalled(signals)) return false;
  }
  return true;
}

void waitForEnd(const sigset_t& signals) {
  while (ros::ok() && !endSignalled(signals)) {
  }
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);  // a second one ends the process without waiting
}

void runNode(const sigset_t& signals) {
  if (!waitForMaster(signals)) return;
  ros::NodeHandle nh;
  endBySignalOnMastersWord();
  const auto params = ompl_planner::readNodeParams(nh, ros::NodeHandle("~"));
  ompl_planner::CurrentPlanner planner(
      nh, std::make_shared<ompl_planner::MotionPlanner>(params.model, params.rates, params.planner));
  ompl_planner::RobotState state(nh, params.model, params.node.joint_state_timeout_s);
  ompl_planner::MapKeeper maps(nh, planner, state);
  const ompl_planner::PathPublisher paths(nh);
  ompl_planner::Planning planning(planner, state, maps, paths, params.node);
  ompl_planner::Execution execution(planner, state, maps, paths, params);
  maps.onPlaced([&planning](const ompl_planner::PlacedMap& map) { planning.warm(map); });
  planner.onChange([&maps] { maps.placeAgain(); });
  ompl_planner::ActionServers servers(nh, planning, execution);
  ros::AsyncSpinner spinner(3);  // last: its threads end before what they call
  spinner.start();
  ROS_INFO("ompl_planner is ready for robot '%s'", params.model->name().c_str());
  waitForEnd(signals);
  servers.close();
  ros::WallDuration(0.2).sleep();  // roscpp drops what it has not sent when it shuts down
  ros::shutdown();
}

}  // namespace

int main(int argc, char** argv) {
  fv_common::endInOneLine();
  const sigset_t signals = holdEndSignals();
  ros::init(argc, argv, "ompl_planner", ros::init_options::NoSigintHandler);
  try {
    runNode(signals);
    return 0;
  } catch (const std::exception& error) {
    ROS_FATAL("ompl_planner: %s", error.what());
    return 1;
  }
}
