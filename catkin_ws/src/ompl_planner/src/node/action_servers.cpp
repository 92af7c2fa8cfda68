#include "action_servers.h"

#include "conversions.h"

namespace ompl_planner {

using fv_msgs::ExecuteMotionResult;
using fv_msgs::PlanAndExecuteResult;
using fv_msgs::PlanMotionResult;

ActionServers::ActionServers(ros::NodeHandle& nh, Planning& planning, Execution& execution)
    : planning_(planning),
      execution_(execution),
      plans_(ros::WallTime::now().toNSec()),
      plan_(nh, "/ompl_planner/plan", [this](const auto&... args) { return plan(args...); }),
      execute_(nh, "/ompl_planner/execute", [this](const auto&... args) { return execute(args...); }),
      plan_and_execute_(nh, "/ompl_planner/plan_and_execute",
                        [this](const auto&... args) { return planAndExecute(args...); }) {}

void ActionServers::close() {
  plan_and_execute_.close();
  execute_.close();
  plan_.close();
}

PlanMotionResult ActionServers::plan(const fv_msgs::PlanMotionGoal& goal, const Cancelled& cancelled,
                                     const PlanServer::Tell& tell) {
  const auto on_stage = [&tell](const std::string& stage) {
    fv_msgs::PlanMotionFeedback feedback;
    feedback.stage = stage;
    tell(feedback);
  };
  return answerTo(planning_.plan(goal, cancelled, on_stage));
}

PlanMotionResult ActionServers::answerTo(const PlanResult& result) {
  PlanMotionResult answer = msgFromResult(result);
  if (result.status == PlanStatus::Success) {
    answer.plan = plans_.keep(std::make_shared<PlannedMotion>(
        PlannedMotion{result.trajectory, answer.trajectory, result.map_sequence}));
  }
  return answer;
}

PlannedMotionPtr ActionServers::motionOf(const fv_msgs::ExecuteMotionGoal& goal) const {
  if (goal.plan == 0) {
    return std::make_shared<PlannedMotion>(
        PlannedMotion{trajectoryFromMsg(goal.trajectory), goal.trajectory, goal.map_sequence});
  }
  if (!goal.trajectory.points.empty())
    throw std::invalid_argument("the goal has a plan's number and a trajectory; valid: one of them");
  const PlannedMotionPtr motion = plans_.get(goal.plan);
  if (!motion) {
    throw std::invalid_argument("plan " + std::to_string(goal.plan) + " is not known (any more); the last " +
                                std::to_string(KeptPlans::kKept) + " are kept");
  }
  return motion;
}

ExecuteMotionResult ActionServers::execute(const fv_msgs::ExecuteMotionGoal& goal, const Cancelled& cancelled,
                                           const ExecuteServer::Tell& tell) {
  const Turns::Turn turn = execution_.takeTurn(cancelled);
  return execution_.execute([&] { return motionOf(goal); }, turn,
                            [&tell](double fraction) {
                              fv_msgs::ExecuteMotionFeedback feedback;
                              feedback.fraction = fraction;
                              tell(feedback);
                            });
}

PlanAndExecuteResult ActionServers::planAndExecute(const fv_msgs::PlanAndExecuteGoal& goal,
                                                   const Cancelled& cancelled,
                                                   const PlanAndExecuteServer::Tell& tell) {
  const auto tell_stage = [&tell](const std::string& stage, double fraction) {
    fv_msgs::PlanAndExecuteFeedback feedback;
    feedback.stage = stage;
    feedback.fraction = fraction;
    tell(feedback);
  };
  const Turns::Turn turn = execution_.takeTurn(cancelled);  // first: a plan begins where the arm rests
  PlanAndExecuteResult result;
  result.plan = answerTo(planning_.plan(
      goal.plan, [&turn] { return turn.stopped(); },
      [&](const std::string& stage) { tell_stage(stage, 0.0); }));
  result.message = result.plan.message;
  if (result.plan.status != PlanMotionResult::SUCCESS) {
    const bool stopped = result.plan.status == PlanMotionResult::CANCELLED;
    result.status = stopped ? PlanAndExecuteResult::CANCELLED : PlanAndExecuteResult::NOT_PLANNED;
    return result;
  }
  result.execution = execution_.execute([&] { return plans_.get(result.plan.plan); }, turn,
                                        [&](double fraction) { tell_stage("execute", fraction); });
  result.message = result.execution.message;
  const auto status = result.execution.status;
  result.status = status == ExecuteMotionResult::SUCCESS     ? PlanAndExecuteResult::SUCCESS
                  : status == ExecuteMotionResult::CANCELLED ? PlanAndExecuteResult::CANCELLED
                                                             : PlanAndExecuteResult::NOT_EXECUTED;
  return result;
}

}  // namespace ompl_planner
