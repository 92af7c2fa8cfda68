/// The action /ompl_planner/plan.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <fv_msgs/PlanMotionAction.h>

#include <atomic>
#include <mutex>
#include <optional>

#include "map_keeper.h"
#include "node_params.h"
#include "ompl_planner/motion_planner.h"
#include "robot_state.h"

namespace ompl_planner {

/// One plan at a time: a new goal cancels the one that is being planned.
class PlanServer {
 public:
  PlanServer(ros::NodeHandle& nh, const MotionPlanner& planner, const RobotState& state, MapKeeper& maps,
             const NodeConfig& config);
  ~PlanServer();

 private:
  void onGoal(const fv_msgs::PlanMotionGoalConstPtr& goal);
  PlanResult plan(const fv_msgs::PlanMotionGoal& goal);
  bool fillRequest(const fv_msgs::PlanMotionGoal& goal, PlanRequest& request, PlanResult& failure);

  /// Prepares the next plan of the last request's kind on a new map.
  void warm(const PlacedMap& map);

  const MotionPlanner& planner_;
  const RobotState& state_;
  MapKeeper& maps_;
  NodeConfig config_;
  std::atomic<bool> cancel_{false};
  std::mutex last_mutex_;
  std::optional<PlanRequest> last_;  ///< The last request that came as far as planning.
  actionlib::SimpleActionServer<fv_msgs::PlanMotionAction> server_;
};

}  // namespace ompl_planner
