/// Mesh files as triangles: the one reader of them.
#pragma once

#include <Eigen/Core>
#include <string>

#include "fv_robot_model/types.h"

namespace fv_robot_model {

struct TriangleMesh {
  using Triangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;
  Points vertices;  ///< (V, 3) [m], corners that several triangles share may be there several times.
  Triangles
      triangles;  ///< (T, 3) rows of vertices, counter-clockwise seen from outside; T = 0 for bare points.
};

/// A mesh file (.stl, .obj, .dae), scaled per axis.
/// A Collada file's unit is honoured, its up axis is not, as RViz does it.
/// @throws ModelError naming the file when it cannot be read or is empty, or scale holds a 0.
TriangleMesh loadMesh(const std::string& file, const Eigen::Vector3d& scale = Eigen::Vector3d::Ones());

}  // namespace fv_robot_model
