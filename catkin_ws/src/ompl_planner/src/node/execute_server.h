/// The action /ompl_planner/execute.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <fv_msgs/ExecuteMotionAction.h>

#include <atomic>
#include <memory>
#include <string>

#include "controller_set.h"
#include "map_keeper.h"
#include "node_params.h"
#include "ompl_planner/motion_planner.h"
#include "robot_state.h"

namespace ompl_planner {

/// One motion at a time: a new goal stops the one that runs.
class ExecuteServer {
 public:
  ExecuteServer(ros::NodeHandle& nh, const MotionPlanner& planner, const RobotState& state, MapKeeper& maps,
                const NodeParams& params);
  ~ExecuteServer();

 private:
  struct Motion;
  void onGoal(const fv_msgs::ExecuteMotionGoalConstPtr& goal);
  void run(Motion& motion);
  bool prepare(Motion& motion);
  void watch(Motion& motion);
  /// What of the changes since the motion's map is in the way from from_s on; empty when nothing.
  std::string obstacle(Motion& motion, double from_s);
  void publishPath(const Motion& motion);

  const MotionPlanner& planner_;
  const RobotState& state_;
  MapKeeper& maps_;
  NodeConfig config_;
  std::vector<Controller> controllers_;
  ros::Publisher path_publisher_;
  std::atomic<bool> cancel_{false};
  actionlib::SimpleActionServer<fv_msgs::ExecuteMotionAction> server_;
};

}  // namespace ompl_planner
