/// The actions /ompl_planner/plan, /ompl_planner/execute and /ompl_planner/plan_and_execute.
#pragma once

#include <fv_msgs/ExecuteMotionAction.h>
#include <fv_msgs/PlanAndExecuteAction.h>
#include <fv_msgs/PlanMotionAction.h>

#include <functional>

#include "execution.h"
#include "goal_server.h"
#include "kept_plans.h"
#include "planning.h"

namespace ompl_planner {

/// All three, on the same planning and execution.
class ActionServers {
 public:
  ActionServers(ros::NodeHandle& nh, Planning& planning, Execution& execution);

  /// Stops the arm, answers all goals, and takes no more.
  void close();

 private:
  using PlanServer = GoalServer<fv_msgs::PlanMotionAction>;
  using ExecuteServer = GoalServer<fv_msgs::ExecuteMotionAction>;
  using PlanAndExecuteServer = GoalServer<fv_msgs::PlanAndExecuteAction>;
  using Cancelled = std::function<bool()>;

  /// The answer to a plan, which is kept when it is a motion.
  fv_msgs::PlanMotionResult answerTo(const PlanResult& result);
  /// @throws std::invalid_argument for a number that no plan has, or a trajectory that cannot be read.
  PlannedMotionPtr motionOf(const fv_msgs::ExecuteMotionGoal& goal) const;

  fv_msgs::PlanMotionResult plan(const fv_msgs::PlanMotionGoal& goal, const Cancelled& cancelled,
                                 const PlanServer::Tell& tell);
  fv_msgs::ExecuteMotionResult execute(const fv_msgs::ExecuteMotionGoal& goal, const Cancelled& cancelled,
                                       const ExecuteServer::Tell& tell);
  fv_msgs::PlanAndExecuteResult planAndExecute(const fv_msgs::PlanAndExecuteGoal& goal,
                                               const Cancelled& cancelled,
                                               const PlanAndExecuteServer::Tell& tell);

  Planning& planning_;
  Execution& execution_;
  KeptPlans plans_;
  PlanServer plan_;
  ExecuteServer execute_;
  PlanAndExecuteServer plan_and_execute_;
};

}  // namespace ompl_planner
