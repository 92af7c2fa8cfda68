/// Everything that belongs to one request. Internal to MotionPlanner.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "goal_sampler.h"
#include "ompl_planner/motion_planner.h"
#include "state_checker.h"

namespace ompl_planner {

struct MotionPlanner::Job {
  const PlanRequest& request;
  const fv_robot_model::Group& group;
  StopCondition stop;
  StageCallback on_stage;
  PlanResult result{};
  std::chrono::steady_clock::time_point stage_begin{std::chrono::steady_clock::now()};

  JointVector start{};
  std::unique_ptr<StateChecker> searcher{};  ///< With search margin.
  std::unique_ptr<StateChecker> judge{};
  std::shared_ptr<const FastCollision> fast{};
  GoalStates goals{};
  JointPath path{};
  double search_step{0.0};     ///< Joint step of the search's edges [rad].
  bool may_use_roadmap{true};  ///< Of earlier queries.

  void beginStage(const std::string& name) {
    endStage();
    result.stages.emplace_back(name, 0.0);
    if (on_stage) on_stage(name);
  }
  void endStage() {
    const auto now = std::chrono::steady_clock::now();
    if (!result.stages.empty()) {
      result.stages.back().second = std::chrono::duration<double>(now - stage_begin).count();
    }
    stage_begin = now;
  }
  bool fail(PlanStatus status, const std::string& message) {
    result.status = stop.cancelled() ? PlanStatus::Cancelled : status;
    result.message = stop.cancelled() ? "cancelled" : message;
    return false;
  }
};

}  // namespace ompl_planner
