/// From goals of a request to joint states.
#pragma once

#include <fv_robot_model/ik/ik_solver.h>
#include <fv_robot_model/robot_model.h>

#include <memory>
#include <string>
#include <vector>

#include "ompl_planner/config.h"
#include "ompl_planner/plan_types.h"
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

/// The values of a group's joints out of those of all joints.
JointVector groupValues(const fv_robot_model::Group& group, const Eigen::VectorXd& q_all);

/// The joint state of a GOAL_JOINTS or GOAL_NAMED request.
/// @throws std::invalid_argument for unknown names, joints outside the group, values that are not finite or
/// outside the limits.
JointVector jointGoal(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                      const PlanRequest& request);

/// Takes the tip's frame to that of the link that the poses speak of.
/// @throws std::invalid_argument unless only fixed joints lie between tip_link and the group's tip.
Eigen::Isometry3d tipToTool(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                            const std::string& tip_link);

/// Inverse kinematics of a group as goal sampling wants it: the closed form that fits, redundant joints
/// stepped by ik_step_rad; an arm with fewer than six joints may miss directions by the angle tolerance.
/// @throws std::invalid_argument when the group is no chain, or one that has no inverse kinematics.
std::unique_ptr<fv_robot_model::ik::IkSolver> makeGoalIk(const fv_robot_model::RobotModel& model,
                                                         const fv_robot_model::Group& group,
                                                         const PlannerConfig& config,
                                                         double angle_tolerance_rad);

/// Joint states that reach the request's poses. Round by round over all poses, so that many views share the
/// effort: the first round takes solutions near the start, the second ones near the request's seeds, later
/// ones other rolls, and the last half also poses within the tolerances.
GoalStates sampleGoalStates(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                            const PlanRequest& request, const PlannerConfig& config,
                            const fv_robot_model::ik::IkSolver& ik, const StateChecker& checker,
                            const StopCondition& stop);

}  // namespace ompl_planner
