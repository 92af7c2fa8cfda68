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

  /// Do the blocks that hold the voxels from low to high (both included, both in the grid) have only Free
  /// voxels? True is certain; false may be due to a voxel of a block that lies outside of the box.
  bool allFree(const VoxelIndex& low, const VoxelIndex& high) const;

 private:
  static constexpr int kShift = 2;
  VoxelIndex origin_;
  Eigen::Vector3i size_;               ///< In blocks.
  std::vector<std::uint8_t> blocked_;  ///< z fastest.
};

}  // namespace ompl_planner
