/// What all queries take as a view.
#pragma once

#include <Eigen/Core>

namespace capability_map {

/// The unit vector along a view's direction, which may have any length but 0: denormal and huge ones too.
/// @param position Only checked.
/// @throws std::invalid_argument where a number is not finite, or no direction is left.
Eigen::Vector3d viewDirection(const Eigen::Vector3d& position, const Eigen::Vector3d& direction);

}  // namespace capability_map
