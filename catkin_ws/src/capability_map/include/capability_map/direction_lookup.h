/// Which of the stored directions are near a given one? In constant time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "capability_map/sphere_grid.h"

namespace capability_map {

/// Octahedral texture over the sphere; each texel lists the directions and triangles that can matter inside
/// of it.
class DirectionLookup {
 public:
  /// Corner directions of the triangle around a direction with their weights (>= 0, sum 1).
  struct Blend {
    std::array<int, 3> index;
    std::array<double, 3> weight;
  };

  /// @param directions (N, 3) unit vectors.
  /// @param triangles (T, 3) corner indices of their convex hull (spherical Delaunay triangulation).
  /// @throws std::invalid_argument for vectors that are not unit, or triangles that name no direction or do
  /// not
  ///         cover the sphere.
  DirectionLookup(const Points& directions,
                  const Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>& triangles);

  /// The nearest direction. @param d Unit vector.
  int nearest(const Eigen::Vector3d& d) const;
  /// The triangle around d, weights linear on it.
  Blend blend(const Eigen::Vector3d& d) const;

 private:
  struct Lists {  // items of texel t are item[start[t]] .. item[start[t + 1]]
    std::vector<int32_t> start;
    std::vector<int32_t> item;
  };
  int texelAt(const Eigen::Vector3d& d) const;
  void listTexel(int texel, const Eigen::MatrixX4d& caps);

  std::vector<Eigen::Vector3d> directions_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<Eigen::Matrix3d> to_weights_;  ///< Inverse of the triangle's corner matrix.
  Lists near_;
  Lists around_;
};

}  // namespace capability_map
