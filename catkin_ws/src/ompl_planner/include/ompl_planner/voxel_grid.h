/// A dense copy of the part of the map that the robot can reach.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <cstring>
#include <vector>

namespace octomap {
class OcTree;
}

namespace ompl_planner {

enum class Voxel : std::uint8_t { Unknown = 0, Free = 1, Occupied = 2 };

/// How unknown space is taken.
enum class UnknownSpace : std::uint8_t { Obstacle = 0, Free = 1, FreeNearStart = 2 };

/// Integer number of a voxel: voxel k spans [k, k + 1) * resolution on each axis of the map frame, as
/// OctoMap's.
using VoxelIndex = Eigen::Vector3i;

/// Voxels of an axis-aligned box, three-valued. OctoMap's absent nodes are Unknown here, and so is everything
/// outside of the box: the distinction that FCL's octree does not make.
class VoxelGrid {
 public:
  /// All voxels that meet the region, Unknown.
  /// @throws std::invalid_argument unless resolution_m > 0, the region is finite, not empty, has at most 2^28
  /// voxels, and none more than 2^30 voxels from the origin.
  VoxelGrid(double resolution_m, const Eigen::AlignedBox3d& region_m);

  /// Copies the octree's leaves; big leaves fill all voxels they span.
  static VoxelGrid fromOctree(const octomap::OcTree& tree, const Eigen::AlignedBox3d& region_m);

  /// The same straight from the data of an octomap_msgs/Octomap with binary = true, without making a tree.
  /// @throws std::invalid_argument when the data end early, go on after the tree, or have no voxels.
  static VoxelGrid fromBinaryPayload(const void* data, std::size_t size, double resolution_m,
                                     const Eigen::AlignedBox3d& region_m);

  double resolution() const { return resolution_; }
  const VoxelIndex& origin() const { return origin_; }
  const Eigen::Vector3i& size() const { return size_; }
  std::size_t count() const { return voxels_.size(); }

  bool contains(const VoxelIndex& index) const {
    const Eigen::Array3i local = (index - origin_).array();
    return (local >= 0).all() && (local < size_.array()).all();
  }
  /// Position in memory, z fastest; only for indices that contains() accepts.
  std::size_t offset(const VoxelIndex& index) const {
    const Eigen::Vector3i local = index - origin_;
    return (static_cast<std::size_t>(local.x()) * static_cast<std::size_t>(size_.y()) +
            static_cast<std::size_t>(local.y())) *
               static_cast<std::size_t>(size_.z()) +
           static_cast<std::size_t>(local.z());
  }
  VoxelIndex indexAt(std::size_t offset) const;

  Voxel at(const VoxelIndex& index) const {
    return contains(index) ? voxels_[offset(index)] : Voxel::Unknown;
  }
  Voxel atOffset(std::size_t offset) const { return voxels_[offset]; }
  /// Are `count` voxels from an offset on all Free? Eight at a time: most rows are.
  bool rowIsFree(std::size_t offset, std::size_t count) const {
    constexpr std::uint64_t kAllFree = 0x0101010101010101U;
    std::size_t i = offset;
    for (; i + 8 <= offset + count; i += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, voxels_.data() + i, sizeof(eight));
      if (eight != kAllFree) return false;
    }
    for (; i < offset + count; ++i) {
      if (voxels_[i] != Voxel::Free) return false;
    }
    return true;
  }
  void set(const VoxelIndex& index, Voxel value) {
    if (contains(index)) voxels_[offset(index)] = value;
  }
  void setOffset(std::size_t offset, Voxel value) { voxels_[offset] = value; }

  VoxelIndex indexOf(const Eigen::Vector3d& p_map) const {
    return (p_map / resolution_).array().floor().cast<int>();
  }
  Eigen::Vector3d centerOf(const VoxelIndex& index) const {
    return (index.cast<double>().array() + 0.5) * resolution_;
  }

  bool coversSameVoxels(const VoxelGrid& other) const {
    return other.origin_ == origin_ && other.size_ == size_ && other.resolution_ == resolution_;
  }

  /// Offsets of voxels that differ. @throws std::invalid_argument when the grids do not cover the same
  /// voxels.
  std::vector<std::size_t> changedSince(const VoxelGrid& older) const;

 private:
  double resolution_;
  VoxelIndex origin_;
  Eigen::Vector3i size_;
  std::vector<Voxel> voxels_;
};

}  // namespace ompl_planner
