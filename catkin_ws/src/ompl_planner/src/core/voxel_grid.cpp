#include "ompl_planner/voxel_grid.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <stdexcept>

namespace ompl_planner {
namespace {

constexpr double kMaxVoxels = 268435456.0;  // 2^28, a quarter of a GiB
constexpr int kTreeDepth = 16;
constexpr int kKeyOffset = 32768;  // OctoMap's key of voxel 0

/// Walks the octree depth first and writes its leaves into the grid, skipping what lies outside.
class LeafCopier {
 public:
  LeafCopier(const octomap::OcTree& tree, VoxelGrid& grid)
      : tree_(tree), grid_(grid), low_(grid.origin()), high_(grid.origin() + grid.size()) {}

  void run() {
    if (tree_.getRoot() != nullptr)
      visit(tree_.getRoot(), VoxelIndex::Constant(-kKeyOffset), 1 << kTreeDepth);
  }

 private:
  void visit(const octomap::OcTreeNode* node, const VoxelIndex& corner, int edge) {
    if ((corner.array() >= high_.array()).any() || (corner.array() + edge <= low_.array()).any()) return;
    if (!tree_.nodeHasChildren(node)) {
      fill(corner, edge, tree_.isNodeOccupied(node) ? Voxel::Occupied : Voxel::Free);
      return;
    }
    const int half = edge / 2;
    for (unsigned int child = 0; child < 8; ++child) {
      if (!tree_.nodeChildExists(node, child)) continue;
      const VoxelIndex offset((child & 1U) ? half : 0, (child & 2U) ? half : 0, (child & 4U) ? half : 0);
      visit(tree_.getNodeChild(node, child), corner + offset, half);
    }
  }

  void fill(const VoxelIndex& corner, int edge, Voxel value) {
    const VoxelIndex begin = corner.cwiseMax(low_);
    const VoxelIndex end = (corner.array() + edge).matrix().cwiseMin(high_);
    for (int x = begin.x(); x < end.x(); ++x) {
      for (int y = begin.y(); y < end.y(); ++y) {
        const std::size_t row = grid_.offset({x, y, begin.z()});
        for (int z = 0; z < end.z() - begin.z(); ++z)
          grid_.setOffset(row + static_cast<std::size_t>(z), value);
      }
    }
  }

  const octomap::OcTree& tree_;
  VoxelGrid& grid_;
  VoxelIndex low_;
  VoxelIndex high_;
};

}  // namespace

VoxelGrid::VoxelGrid(double resolution_m, const Eigen::AlignedBox3d& region_m) : resolution_(resolution_m) {
  if (!(resolution_m > 0.0)) throw std::invalid_argument("voxel grid: resolution must be positive");
  if (region_m.isEmpty() || !region_m.min().allFinite() || !region_m.max().allFinite()) {
    throw std::invalid_argument("voxel grid: the region is empty or not finite");
  }
  origin_ = indexOf(region_m.min());
  const Eigen::Vector3d voxels = (region_m.sizes() / resolution_m).array() + 2.0;
  if (voxels.prod() > kMaxVoxels) throw std::invalid_argument("voxel grid: more than 2^28 voxels");
  size_ = indexOf(region_m.max()) - origin_ + Eigen::Vector3i::Ones();
  voxels_.assign(static_cast<std::size_t>(size_.cast<long>().prod()), Voxel::Unknown);
}

VoxelGrid VoxelGrid::fromOctree(const octomap::OcTree& tree, const Eigen::AlignedBox3d& region_m) {
  VoxelGrid grid(tree.getResolution(), region_m);
  LeafCopier(tree, grid).run();
  return grid;
}

VoxelIndex VoxelGrid::indexAt(std::size_t offset) const {
  const auto nz = static_cast<std::size_t>(size_.z());
  const auto ny = static_cast<std::size_t>(size_.y());
  const auto z = static_cast<int>(offset % nz);
  const auto y = static_cast<int>((offset / nz) % ny);
  const auto x = static_cast<int>(offset / (nz * ny));
  return origin_ + VoxelIndex(x, y, z);
}

std::vector<std::size_t> VoxelGrid::changedSince(const VoxelGrid& older) const {
  if (older.origin_ != origin_ || older.size_ != size_ || older.resolution_ != resolution_) {
    throw std::invalid_argument("voxel grids of different regions cannot be compared");
  }
  std::vector<std::size_t> changed;
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    if (voxels_[i] != older.voxels_[i]) changed.push_back(i);
  }
  return changed;
}

}  // namespace ompl_planner
