/// From goals of a request to joint states.
#pragma once

#include <fv_robot_model/robot_model.h>

#include <string>
#include <vector>

#include "ompl_planner/config.h"
#include "ompl_planner/plan_types.h"
#include "ompl_planner/pose_ik.h"
#include "ompl_planner/state_checker.h"

namespace ompl_planner {

struct GoalState {
  JointVector q;
  int goal_index;  ///< Which pose it reaches; -1 for joint goals.
};

struct GoalStates {
  std::vector<GoalState> states;  ///< Free of collision, best score per way to go first.
  std::uint32_t poses_tried{0};
  std::uint32_t poses_reachable{0};
  std::string blocked_reason;      ///< Of one solution in collision, when there was any.
  std::string unreachable_reason;  ///< When no pose has a solution.
};

/// The joint state of a GOAL_JOINTS or GOAL_NAMED request.
/// @throws std::invalid_argument for unknown names, joints outside the group, values that are not finite or
/// outside the
///   limits.
JointVector jointGoal(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                      const PlanRequest& request);

/// Takes the tip's frame to that of the link that the poses speak of.
/// @throws std::invalid_argument unless only fixed joints lie between tip_link and the group's tip.
Eigen::Isometry3d tipToTool(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                            const std::string& tip_link);

/// Joint states that reach the request's poses: for each pose IK from the start state, then from random
/// states.
GoalStates sampleGoalStates(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                            const PlanRequest& request, const PlannerConfig& config, const PoseIk& ik,
                            const StateChecker& checker, const StopCondition& stop);

}  // namespace ompl_planner
