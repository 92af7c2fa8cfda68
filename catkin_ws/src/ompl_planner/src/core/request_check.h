/// What a request must satisfy before anything is computed for it.
#pragma once

#include <fv_robot_model/robot_model.h>

#include <string>
#include <vector>

#include "ompl_planner/plan_types.h"

namespace ompl_planner {

/// @throws std::invalid_argument (or UnknownNameError, which is one) naming the field, its value and what
/// would be valid.
void checkRequest(const fv_robot_model::RobotModel& model, const PlanRequest& request);

/// @throws std::invalid_argument when `what` names a joint more than once: of two values, which?
void checkNamedOnce(const std::vector<std::string>& joints, const std::string& what);

/// The first joint of a group that is outside its limits by more than a tolerance, with both; empty when none
/// is.
std::string outsideLimits(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                          const JointVector& q, double tolerance);

}  // namespace ompl_planner
