/// Moves the robot along a trajectory, and stops it when it must not go on.
#pragma once

#include <fv_msgs/ExecuteMotionAction.h>
#include <ros/ros.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "controller_set.h"
#include "current_planner.h"
#include "map_keeper.h"
#include "node_params.h"
#include "robot_state.h"
#include "turns.h"

namespace ompl_planner {

/// One motion at a time: a new one stops the one that runs. Thread-safe.
class Execution {
 public:
  Execution(ros::NodeHandle& nh, const CurrentPlanner& planner, const RobotState& state, MapKeeper& maps,
            const NodeParams& params);

  /// Returns when the motion is done or the arm has stopped; everything that goes wrong is a status of the
  /// result.
  /// @param on_fraction Told now and then which share of the trajectory's duration is over.
  fv_msgs::ExecuteMotionResult execute(const fv_msgs::ExecuteMotionGoal& goal,
                                       const std::function<bool()>& cancelled,
                                       const std::function<void(double)>& on_fraction);

 private:
  struct Motion;
  void run(Motion& motion);
  bool prepare(Motion& motion);
  bool startsWhereTheRobotIs(Motion& motion) const;
  bool mapAllows(Motion& motion);
  void watch(Motion& motion);
  bool goesOn(Motion& motion, double elapsed_s);
  void stop(Motion& motion);
  /// What of the changes since the motion's map is in the way from from_s on; empty when nothing.
  std::string obstacle(Motion& motion, double from_s);
  void publishPath(const Motion& motion);

  const CurrentPlanner& planner_;
  const RobotState& state_;
  MapKeeper& maps_;
  NodeConfig config_;
  std::vector<Controller> controllers_;
  ros::Publisher path_publisher_;
  Turns turns_;
};

}  // namespace ompl_planner
