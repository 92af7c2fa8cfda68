/// Mesh files as bare points.
#pragma once

#include <Eigen/Core>
#include <string>

#include "fv_robot_model/robot_model.h"

namespace fv_robot_model {

/// Absolute file name of a mesh as the URDF writes it. @throws ModelError when it cannot be told or does not
/// exist.
std::string resolveMesh(const std::string& uri, const MeshResolver& resolver);

/// Convex hull of a mesh file (.stl, .obj, .dae), scaled per axis.
/// @throws ModelError naming the file when it cannot be read, has no volume, or is larger than a robot's
/// link.
Shape meshHull(const std::string& file, const Eigen::Vector3d& scale, const Eigen::Isometry3d& T_link_shape);

}  // namespace fv_robot_model
