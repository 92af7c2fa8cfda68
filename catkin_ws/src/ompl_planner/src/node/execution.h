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
#include "kept_plans.h"
#include "map_keeper.h"
#include "node_params.h"
#include "path_publisher.h"
#include "robot_state.h"
#include "turns.h"

namespace ompl_planner {

/// One motion at a time: a new one stops the one that runs. Thread-safe.
class Execution {
 public:
  Execution(const CurrentPlanner& planner, const RobotState& state, MapKeeper& maps,
            const PathPublisher& paths, const NodeParams& params);

  /// Stops the motion that runs, and waits for it, as every turn does.
  Turns::Turn takeTurn(std::function<bool()> cancelled) { return {turns_, std::move(cancelled)}; }

  /// Returns when the motion is done or the arm has stopped; everything that goes wrong is a status of the
  /// result.
  /// @param planned Gives the motion, or throws std::invalid_argument: the request is invalid.
  /// @param turn Of this motion; it is asked all the time whether the arm is to stop.
  /// @param on_fraction Told now and then which share of the trajectory's duration is over.
  fv_msgs::ExecuteMotionResult execute(const std::function<PlannedMotionPtr()>& planned,
                                       const Turns::Turn& turn,
                                       const std::function<void(double)>& on_fraction);

 private:
  struct Motion;
  void run(Motion& motion);
  bool prepare(Motion& motion);
  bool startsWhereTheRobotIs(Motion& motion) const;
  bool mapAllows(Motion& motion);
  void watch(Motion& motion);
  bool withinLimits(Motion& motion) const;
  bool goesOn(Motion& motion, double elapsed_s);
  void stop(Motion& motion);
  void waitForRest(const Motion& motion) const;
  /// What of the changes since the motion's map is in the way from from_s on; empty when nothing.
  std::string obstacle(Motion& motion, double from_s);
  void show(const Motion& motion);

  const CurrentPlanner& planner_;
  const RobotState& state_;
  MapKeeper& maps_;
  NodeConfig config_;
  ControllerClients controllers_;
  const PathPublisher& paths_;
  Turns turns_;
};

}  // namespace ompl_planner
