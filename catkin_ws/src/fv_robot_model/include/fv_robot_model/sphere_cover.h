/// Links as unions of balls, for a planner's fast conservative checks.
#pragma once

#include "fv_robot_model/robot_model.h"

namespace fv_robot_model {

/// Balls, link frame, whose union contains the shape; no radius exceeds max_radius_m.
/// @throws std::invalid_argument unless max_radius_m is finite and positive, or when more than 100,000 were
/// needed.
Spheres sphereCover(const Shape& shape, double max_radius_m);

/// The same for all shapes of a link. Empty for a link without shapes. @throws std::out_of_range for the
/// index.
Spheres sphereCover(const RobotModel& model, int link_index, double max_radius_m);

}  // namespace fv_robot_model
