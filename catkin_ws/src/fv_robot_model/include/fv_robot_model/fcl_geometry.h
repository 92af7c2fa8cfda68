/// Shapes as FCL geometry, for those who check collisions.
#pragma once

#include <fcl/geometry/collision_geometry.h>

#include <memory>

#include "fv_robot_model/shape.h"

namespace fv_robot_model {

/// FCL geometry in the shape's own frame; use T_root_link * shape.T_link_shape as its transform. Grow it
/// first with padded() where wanted. Immutable and shareable among threads.
std::shared_ptr<const fcl::CollisionGeometryd> fclGeometry(const Shape& shape);

}  // namespace fv_robot_model
