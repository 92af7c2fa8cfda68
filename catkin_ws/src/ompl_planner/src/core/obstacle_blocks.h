/// Which parts of a grid hold no obstacle at all?
#pragma once

#include <cstdint>
#include <vector>

#include "ompl_planner/voxel_grid.h"

namespace ompl_planner {

/// One byte for each block of 4 x 4 x 4 voxels, for quick looks before slow ones. Immutable.
class ObstacleBlocks {
 public:
  explicit ObstacleBlocks(const VoxelGrid& grid);

  /// Calls visit(first voxel, last voxel) for each block that holds an obstacle and meets the box from low to
  /// high, cut to the box, until it returns false; then returns false too.
  template <typename Visit>
  bool visitBlocked(const VoxelIndex& low, const VoxelIndex& high, const Visit& visit) const {
    const VoxelIndex begin = low - origin_;
    const VoxelIndex end = high - origin_;
    for (int x = begin.x() >> kShift; x <= end.x() >> kShift; ++x) {
      for (int y = begin.y() >> kShift; y <= end.y() >> kShift; ++y) {
        const auto row = static_cast<std::size_t>(x * size_.y() + y) * static_cast<std::size_t>(size_.z());
        for (int z = begin.z() >> kShift; z <= end.z() >> kShift; ++z) {
          if (blocked_[row + static_cast<std::size_t>(z)] == 0) continue;
          const VoxelIndex first = origin_ + VoxelIndex(x, y, z) * kEdge;
          const VoxelIndex last = first + VoxelIndex::Constant(kEdge - 1);
          if (!visit(first.cwiseMax(low), last.cwiseMin(high))) return false;
        }
      }
    }
    return true;
  }

 private:
  static constexpr int kShift = 2;
  static constexpr int kEdge = 1 << kShift;
  VoxelIndex origin_;
  Eigen::Vector3i size_;               ///< In blocks.
  std::vector<std::uint8_t> blocked_;  ///< z fastest.
};

}  // namespace ompl_planner
