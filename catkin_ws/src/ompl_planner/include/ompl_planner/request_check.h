/// What a request must satisfy before anything is computed for it.
#pragma once

#include <fv_robot_model/robot_model.h>

#include "ompl_planner/plan_types.h"

namespace ompl_planner {

/// @throws std::invalid_argument (or UnknownNameError, which is one) naming the field, its value and what
/// would be valid.
void checkRequest(const fv_robot_model::RobotModel& model, const PlanRequest& request);

}  // namespace ompl_planner
