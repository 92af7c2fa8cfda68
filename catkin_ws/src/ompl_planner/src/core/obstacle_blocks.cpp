#include "ompl_planner/obstacle_blocks.h"

#include <algorithm>

namespace ompl_planner {

ObstacleBlocks::ObstacleBlocks(const VoxelGrid& grid) : origin_(grid.origin()) {
  constexpr int kEdge = 1 << kShift;
  size_ = (grid.size().array() + kEdge - 1) / kEdge;
  blocked_.assign(static_cast<std::size_t>(size_.cast<long>().prod()), 0);
  const auto rows = static_cast<std::size_t>(grid.size().z());
  std::size_t from = 0;
  for (int x = 0; x < grid.size().x(); ++x) {
    for (int y = 0; y < grid.size().y(); ++y, from += rows) {
      const auto block_row = static_cast<std::size_t>((x >> kShift) * size_.y() + (y >> kShift)) *
                             static_cast<std::size_t>(size_.z());
      for (std::size_t z = 0; z < rows; z += kEdge) {
        if (!grid.rowIsFree(from + z, std::min<std::size_t>(kEdge, rows - z)))
          blocked_[block_row + (z >> kShift)] = 1;
      }
    }
  }
}

bool ObstacleBlocks::allFree(const VoxelIndex& low, const VoxelIndex& high) const {
  const VoxelIndex begin = low - origin_;
  const VoxelIndex end = high - origin_;
  const auto z_begin = static_cast<std::size_t>(begin.z() >> kShift);
  const auto z_end = static_cast<std::size_t>(end.z() >> kShift);
  for (int x = begin.x() >> kShift; x <= end.x() >> kShift; ++x) {
    for (int y = begin.y() >> kShift; y <= end.y() >> kShift; ++y) {
      const auto row = static_cast<std::size_t>(x * size_.y() + y) * static_cast<std::size_t>(size_.z());
      for (std::size_t z = z_begin; z <= z_end; ++z) {
        if (blocked_[row + z] != 0) return false;
      }
    }
  }
  return true;
}

}  // namespace ompl_planner
