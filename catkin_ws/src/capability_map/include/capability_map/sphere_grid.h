/// Where reachability spheres stand and which directions they hold (thesis 3.2).
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace capability_map {

/// (N, 3) unit vectors or points, row-major: a view of a numpy float64 array.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// N nearly equally distributed points of the unit sphere: the spiral of Rakhmanov, Saff and Zhou (1994),
/// from the south pole to the north pole. These are the thesis's n-vectors (3.9).
/// @throws std::invalid_argument for n < 4.
Points spiralPoints(int n);

/// Cubic cells, one sphere inscribed in each. Frame: the map's base frame.
struct SphereGrid {
  Eigen::Vector3d origin{0.0, 0.0, 0.0};  ///< Smallest corner of the first cell [m].
  double radius_m{0.0};                   ///< Of the spheres; cells have twice that as their edge.
  Eigen::Vector3i size{0, 0, 0};          ///< Cells along x, y, z.

  int64_t cellCount() const { return int64_t{size.x()} * size.y() * size.z(); }
  /// Cells are numbered with z running fastest.
  Eigen::Vector3i place(int64_t cell) const {
    return {static_cast<int>(cell / (int64_t{size.z()} * size.y())),
            static_cast<int>((cell / size.z()) % size.y()), static_cast<int>(cell % size.z())};
  }
  Eigen::Vector3d center(int64_t cell) const {
    return origin + 2.0 * radius_m * (place(cell).cast<double>() + Eigen::Vector3d::Constant(0.5));
  }
  /// Cell that holds a point; -1 outside or for NaN.
  int64_t cellAt(const Eigen::Vector3d& p) const;
};

}  // namespace capability_map
