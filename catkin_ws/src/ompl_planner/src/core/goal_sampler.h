/// From goals of a request to joint states.
#pragma once

#include <fv_robot_model/ik/ik_solver.h>
#include <fv_robot_model/robot_model.h>

#include <memory>
#include <string>
#include <vector>

#include "ompl_planner/config.h"
#include "ompl_planner/plan_types.h"
#include "state_checker.h"

namespace ompl_planner {

struct GoalState {
  JointVector q;
  int goal_index;  ///< Which pose it reaches; -1 for joint goals.
};

struct GoalStates {
  std::vector<GoalState> states;  ///< Free of collision, best score per way to go first.
  std::uint32_t poses_tried{0};
  std::uint32_t poses_reachable{0};
  std::string failure;  ///< How many poses failed and why, when there are no states.
};

/// The values of a group's joints out of those of all joints.
JointVector groupValues(const fv_robot_model::Group& group, const Eigen::VectorXd& q_all);

/// The angle that equals `angle` but for whole turns, within the limits, nearest to `near` [rad]; `angle`
/// itself when none is within them.
double nearestTurn(double angle, double near, const fv_robot_model::JointLimits& limits);

/// Do whole turns of a joint leave every link where it was? Not of one that slides, or whose mimics slide or
/// turn by other than whole multiples.
bool turnsAlike(const fv_robot_model::RobotModel& model, int joint);

/// The whole turns [rad] that continuous joints have made at q_all; 0 for the others.
Eigen::VectorXd wholeTurns(const fv_robot_model::RobotModel& model, const Eigen::VectorXd& q_all);

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
/// stepped by ik_step_rad; an arm with fewer than six joints may miss directions by the angle tolerance. Arms
/// without a closed form are left to TolerantIk.
/// @throws std::invalid_argument when the group is no chain, or one that has no inverse kinematics.
std::unique_ptr<fv_robot_model::ik::IkSolver> makeGoalIk(const fv_robot_model::RobotModel& model,
                                                         const fv_robot_model::Group& group,
                                                         const PlannerConfig& config,
                                                         double angle_tolerance_rad);

/// Joint states that reach the request's poses. Round by round over all poses, so that many views share the
/// effort: the first round takes solutions near the start, the second ones near the request's seeds, later
/// ones other rolls, and the last half also poses within the tolerances. Arms of fewer than six joints and
/// those without a closed form descend on poses within the tolerances (in the last half, and in every round);
/// others do so when all else has found nothing. Joints that may turn all the way round end as near to the
/// start as their limits allow.
GoalStates sampleGoalStates(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                            const PlanRequest& request, const PlannerConfig& config,
                            const fv_robot_model::ik::IkSolver& ik, const StateChecker& checker,
                            const StopCondition& stop);

}  // namespace ompl_planner
