#include "ompl_planner/voxel_grid.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <stdexcept>

namespace ompl_planner {
namespace {

constexpr double kMaxVoxels = 268435456.0;  // 2^28, a quarter of a GiB
constexpr double kMaxIndex = 1073741824.0;  // 2^30: sums of two stay within an int
constexpr int kTreeDepth = 16;
constexpr int kKeyOffset = 32768;  // OctoMap's key of voxel 0

/// Writes leaves of an octree into a grid, as far as they meet it.
class LeafWriter {
 public:
  explicit LeafWriter(VoxelGrid& grid) : grid_(grid), low_(grid.origin()), high_(low_ + grid.size()) {}

  bool misses(const VoxelIndex& corner, int edge) const {
    return (corner.array() >= high_.array()).any() || (corner.array() + edge <= low_.array()).any();
  }

  void fill(const VoxelIndex& corner, int edge, Voxel value) {
    if (edge == 1) {
      grid_.set(corner, value);
      return;
    }
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

  static VoxelIndex childCorner(const VoxelIndex& corner, unsigned int child, int half) {
    return corner + VoxelIndex((child & 1U) ? half : 0, (child & 2U) ? half : 0, (child & 4U) ? half : 0);
  }

 private:
  VoxelGrid& grid_;
  VoxelIndex low_;
  VoxelIndex high_;
};

void copyNode(const octomap::OcTree& tree, const octomap::OcTreeNode* node, const VoxelIndex& corner,
              int edge, LeafWriter& out) {
  if (out.misses(corner, edge)) return;
  if (!tree.nodeHasChildren(node)) {
    out.fill(corner, edge, tree.isNodeOccupied(node) ? Voxel::Occupied : Voxel::Free);
    return;
  }
  for (unsigned int child = 0; child < 8; ++child) {
    if (!tree.nodeChildExists(node, child)) continue;
    copyNode(tree, tree.getNodeChild(node, child), LeafWriter::childCorner(corner, child, edge / 2), edge / 2,
             out);
  }
}

/// OctoMap's binary stream: two bytes for each inner node, two bits for each of its children, the lowest
/// first; 0 unknown, 1 free, 2 occupied, 3 an inner node, whose bytes follow depth first.
class BinaryReader {
 public:
  BinaryReader(const void* data, std::size_t size, VoxelGrid& grid)
      : next_(static_cast<const std::uint8_t*>(data)), end_(next_ + size), out_(grid) {}

  void run() {
    if (next_ == end_) throw std::invalid_argument("octree data: there are no voxels");
    visit(VoxelIndex::Constant(-kKeyOffset), 1 << kTreeDepth);
    if (next_ != end_) throw std::invalid_argument("octree data: there is more after the tree");
    if (leaves_ == 0) throw std::invalid_argument("octree data: there are no voxels");
  }

 private:
  void visit(const VoxelIndex& corner, int edge) {
    if (end_ - next_ < 2 || edge == 1) throw std::invalid_argument("octree data: they are broken");
    const unsigned int children = next_[0] | static_cast<unsigned int>(next_[1]) << 8U;
    next_ += 2;
    const int half = edge / 2;
    const bool outside = out_.misses(corner, edge);
    for (unsigned int child = 0; child < 8; ++child) {
      const unsigned int kind = children >> (2 * child) & 3U;
      if (kind == 0) continue;
      const VoxelIndex child_corner = LeafWriter::childCorner(corner, child, half);
      if (kind == 3) {
        visit(child_corner, half);
        continue;
      }
      ++leaves_;
      if (!outside && !out_.misses(child_corner, half)) {
        out_.fill(child_corner, half, kind == 2 ? Voxel::Occupied : Voxel::Free);
      }
    }
  }

  const std::uint8_t* next_;
  const std::uint8_t* end_;
  LeafWriter out_;
  std::size_t leaves_{0};
};

}  // namespace

VoxelGrid::VoxelGrid(double resolution_m, const Eigen::AlignedBox3d& region_m) : resolution_(resolution_m) {
  if (!(resolution_m > 0.0)) throw std::invalid_argument("voxel grid: resolution must be positive");
  if (region_m.isEmpty() || !region_m.min().allFinite() || !region_m.max().allFinite()) {
    throw std::invalid_argument("voxel grid: the region is empty or not finite");
  }
  const Eigen::Vector3d voxels = (region_m.sizes() / resolution_m).array() + 2.0;
  if (!(voxels.prod() <= kMaxVoxels)) throw std::invalid_argument("voxel grid: more than 2^28 voxels");
  const double farthest =
      region_m.min().cwiseAbs().cwiseMax(region_m.max().cwiseAbs()).maxCoeff() / resolution_m;
  if (!(farthest <= kMaxIndex))
    throw std::invalid_argument("voxel grid: more than 2^30 voxels from the origin");
  origin_ = indexOf(region_m.min());
  size_ = indexOf(region_m.max()) - origin_ + Eigen::Vector3i::Ones();
  voxels_.assign(static_cast<std::size_t>(size_.cast<long>().prod()), Voxel::Unknown);
}

VoxelGrid VoxelGrid::fromOctree(const octomap::OcTree& tree, const Eigen::AlignedBox3d& region_m) {
  VoxelGrid grid(tree.getResolution(), region_m);
  LeafWriter out(grid);
  if (tree.getRoot() != nullptr)
    copyNode(tree, tree.getRoot(), VoxelIndex::Constant(-kKeyOffset), 1 << kTreeDepth, out);
  return grid;
}

VoxelGrid VoxelGrid::fromBinaryPayload(const void* data, std::size_t size, double resolution_m,
                                       const Eigen::AlignedBox3d& region_m) {
  VoxelGrid grid(resolution_m, region_m);
  BinaryReader(data, size, grid).run();
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
  if (!coversSameVoxels(older)) {
    throw std::invalid_argument("voxel grids of different regions cannot be compared");
  }
  std::vector<std::size_t> changed;
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    if (voxels_[i] != older.voxels_[i]) changed.push_back(i);
  }
  return changed;
}

}  // namespace ompl_planner
