/// How far is it to the next obstacle, at least?
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <vector>

#include "ompl_planner/voxel_grid.h"

namespace ompl_planner {

/// Lower bounds of the distance to the voxels of a grid that are not free. Exact at voxel centres (distance
/// to the cubes, not to their centres), up to a cap; elsewhere by the triangle inequality. Immutable.
///
/// Min-plus convolution along each axis with the squared distance between a centre and a cube, (2 |d| - 1)^2
/// / 4 voxels, in integers: the sum over axes is exact, and each pass is a plain loop that compilers
/// vectorise. dynamicEDT3D needs ten times as long to build such a field from nothing, and gives distances
/// between centres.
class DistanceField {
 public:
  /// @param grid     Every voxel but Free is an obstacle.
  /// @param region_m Part of the grid that is covered, map frame [m]; clipped to the grid. All outside of it
  /// counts as
  ///                 obstacle: lower bounds stay true whatever is there.
  /// @param cap_m    Larger distances are not told apart.
  /// @throws std::invalid_argument unless cap_m > 0 and the region meets the grid.
  DistanceField(const VoxelGrid& grid, const Eigen::AlignedBox3d& region_m, double cap_m);

  /// A number not above the distance [m] of p_map to the nearest obstacle, and within a voxel's diagonal of
  /// it or the cap; may be negative near obstacles. Outside of the region: -1.
  double lowerBound(const Eigen::Vector3d& p_map) const {
    const Eigen::Vector3d scaled = p_map * inverse_resolution_ - corner_;
    const Eigen::Vector3d cell = scaled.array().floor();
    const Eigen::Array3i index = cell.cast<int>().array();
    if ((index < 0).any() || (index >= size_.array()).any()) return -1.0;
    const double offset = (scaled - cell - Eigen::Vector3d::Constant(0.5)).norm();
    return (roots_[static_cast<std::size_t>(squares_[offsetOf(index)])] - offset) * resolution_;
  }
  /// Does p_map lie in an obstacle voxel of the region?
  bool inObstacle(const Eigen::Vector3d& p_map) const {
    const Eigen::Array3i index = (p_map * inverse_resolution_ - corner_).array().floor().cast<int>();
    if ((index < 0).any() || (index >= size_.array()).any()) return false;
    return squares_[offsetOf(index)] == 0;
  }

 private:
  std::size_t offsetOf(const Eigen::Array3i& index) const {
    return (static_cast<std::size_t>(index.x()) * static_cast<std::size_t>(size_.y()) +
            static_cast<std::size_t>(index.y())) *
               static_cast<std::size_t>(size_.z()) +
           static_cast<std::size_t>(index.z());
  }
  void sweepRows(Eigen::Index axis, const std::vector<std::int16_t>& cost);
  void sweepColumns(const std::vector<std::int16_t>& cost);
  void lowerToBorder(int reach);

  double resolution_;
  double inverse_resolution_;
  Eigen::Vector3d corner_;  ///< Lowest voxel's lower corner, in voxels.
  Eigen::Vector3i size_;
  std::vector<std::int16_t> squares_;  ///< 4 times the squared distance in voxels; 0: obstacle.
  std::vector<float> roots_;           ///< Distance in voxels of each possible square.
};

}  // namespace ompl_planner
