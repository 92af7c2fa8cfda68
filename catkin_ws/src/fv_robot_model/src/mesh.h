/// Mesh files as bare points.
#pragma once

#include <Eigen/Core>
#include <string>

#include "fv_robot_model/robot_model.h"

namespace fv_robot_model {

/// Absolute file name of a mesh as the URDF writes it. @throws ModelError when it cannot be told or does not
/// exist.
std::string resolveMesh(const std::string& uri, const MeshResolver& resolver);

/// All corners of a mesh file (STL, OBJ, DAE, ... whatever assimp reads), scaled per axis, (N, 3) [m].
/// A Collada file's unit is honoured, its up axis is not, as RViz does it.
/// @throws ModelError when it cannot be read or is empty.
Points loadMeshVertices(const std::string& file, const Eigen::Vector3d& scale);

}  // namespace fv_robot_model
