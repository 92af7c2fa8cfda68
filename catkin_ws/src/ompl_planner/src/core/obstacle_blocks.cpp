#include "obstacle_blocks.h"

#include <algorithm>

namespace ompl_planner {

ObstacleBlocks::ObstacleBlocks(const VoxelGrid& grid) : origin_(grid.origin()) {
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

}  // namespace ompl_planner
