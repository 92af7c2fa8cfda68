#include "action_servers.h"

#include "conversions.h"

namespace ompl_planner {
namespace {

using fv_msgs::ExecuteMotionResult;
using fv_msgs::PlanAndExecuteResult;

/// Ends the goal as its status says.
template <typename Action, typename Result>
void finish(ActionServer<Action>& action, const Result& result, std::uint8_t success,
            std::uint8_t cancelled) {
  if (result.status == success) {
    action.server().setSucceeded(result, result.message);
  } else if (result.status == cancelled) {
    action.server().setPreempted(result, result.message);
  } else {
    ROS_WARN("ompl_planner: %s", result.message.c_str());
    action.server().setAborted(result, result.message);
  }
}

}  // namespace

ActionServers::ActionServers(ros::NodeHandle& nh, Planning& planning, Execution& execution)
    : planning_(planning),
      execution_(execution),
      plan_(nh, "/ompl_planner/plan", [this](auto& action, const auto& goal) { plan(action, *goal); }),
      execute_(nh, "/ompl_planner/execute",
               [this](auto& action, const auto& goal) { execute(action, *goal); }),
      plan_and_execute_(nh, "/ompl_planner/plan_and_execute",
                        [this](auto& action, const auto& goal) { planAndExecute(action, *goal); }) {}

void ActionServers::plan(PlanServer& action, const fv_msgs::PlanMotionGoal& goal) {
  const auto on_stage = [&](const std::string& stage) {
    fv_msgs::PlanMotionFeedback feedback;
    feedback.stage = stage;
    action.server().publishFeedback(feedback);
  };
  const auto result = msgFromResult(planning_.plan(
      goal, [&] { return action.cancelled(); }, on_stage));
  finish(action, result, fv_msgs::PlanMotionResult::SUCCESS, fv_msgs::PlanMotionResult::CANCELLED);
}

void ActionServers::execute(ExecuteServer& action, const fv_msgs::ExecuteMotionGoal& goal) {
  const auto on_fraction = [&](double fraction) {
    fv_msgs::ExecuteMotionFeedback feedback;
    feedback.fraction = fraction;
    action.server().publishFeedback(feedback);
  };
  const auto result = execution_.execute(
      goal, [&] { return action.cancelled(); }, on_fraction);
  finish(action, result, ExecuteMotionResult::SUCCESS, ExecuteMotionResult::CANCELLED);
}

void ActionServers::planAndExecute(PlanAndExecuteServer& action, const fv_msgs::PlanAndExecuteGoal& goal) {
  fv_msgs::PlanAndExecuteFeedback feedback;
  const auto tell = [&](const std::string& stage, double fraction) {
    feedback.stage = stage;
    feedback.fraction = fraction;
    action.server().publishFeedback(feedback);
  };
  const auto cancelled = [&] { return action.cancelled(); };
  PlanAndExecuteResult result;
  result.plan = msgFromResult(
      planning_.plan(goal.plan, cancelled, [&](const std::string& stage) { tell(stage, 0.0); }));
  result.message = result.plan.message;
  if (result.plan.status != fv_msgs::PlanMotionResult::SUCCESS) {
    const bool stopped = result.plan.status == fv_msgs::PlanMotionResult::CANCELLED;
    result.status = stopped ? PlanAndExecuteResult::CANCELLED : PlanAndExecuteResult::NOT_PLANNED;
  } else {
    fv_msgs::ExecuteMotionGoal motion;
    motion.trajectory = result.plan.trajectory;
    motion.map_sequence = result.plan.map_sequence;
    result.execution =
        execution_.execute(motion, cancelled, [&](double fraction) { tell("execute", fraction); });
    result.message = result.execution.message;
    result.status = result.execution.status == ExecuteMotionResult::SUCCESS ? PlanAndExecuteResult::SUCCESS
                    : result.execution.status == ExecuteMotionResult::CANCELLED
                        ? PlanAndExecuteResult::CANCELLED
                        : PlanAndExecuteResult::NOT_EXECUTED;
  }
  finish(action, result, PlanAndExecuteResult::SUCCESS, PlanAndExecuteResult::CANCELLED);
}

}  // namespace ompl_planner
