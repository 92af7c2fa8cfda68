#pragma once
#include <octomap/octomap_types.h>

#include <Eigen/Geometry>
#include <vector>

#include "fv_exploration/occupancy_tree.h"

namespace fv {

/// A scan as the map's rays: all from one origin.
struct ScanRays {
  octomap::point3d origin;                ///< [m], map frame
  std::vector<octomap::point3d> hits;     ///< ends that are occupied, with the space before them free
  std::vector<octomap::point3d> cleared;  ///< ends of free space without a hit
};

/// Voxels to keep, ends included; others are passed through and forgotten.
struct VoxelBox {
  Voxel min;
  Voxel max;
  bool contains(const Voxel& v) const {
    return (v.array() >= min.array()).all() && (v.array() <= max.array()).all();
  }
};

struct MarkCounts {
  int64_t rays = 0;
  int64_t hits = 0;     ///< rays that end in an occupied voxel, or would but for `keep`
  int64_t outside = 0;  ///< rays that end beyond the keys: they mark nothing
  int64_t free = 0;
  int64_t occupied = 0;
};

/// The voxels that a scan passes or hits: the two key sets of OccupancyOcTreeBase::computeUpdate (no bounding
/// box), a voxel that is both being hit. The walk is that of OcTreeBaseImpl::computeRayKeys (Amanatides and
/// Woo 1987), with the same roundings, into a dense grid around the scan, or into blocks where such a grid
/// would be too large.
/// @param dense_limit largest dense grid [bytes].
/// @return blocks with at least one mark inside `keep`, each once, in a fixed order.
std::vector<MarkBlock> markScan(const ScanRays& rays, double resolution_m, const VoxelBox& keep, int threads,
                                std::size_t dense_limit, MarkCounts& counts);

}  // namespace fv
