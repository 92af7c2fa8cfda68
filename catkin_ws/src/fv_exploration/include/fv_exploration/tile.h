#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "fv_exploration/grid.h"
#include "fv_exploration/void_clusters.h"

namespace fv {

/// One bit per voxel of a tile: rows along x, by y + 16 z.
using TileMask = std::array<uint16_t, kTile * kTile>;
/// Label + 1 of each voxel of a tile, 0 for none; empty when all are 0. By x + 16 y + 256 z.
using TileLabels = std::vector<uint16_t>;

/// A label of a tile neighbours a label of the tile in a direction ((dx + 1) + 3 (dy + 1) + 9 (dz + 1); 13:
/// itself).
struct TileLink {
  uint16_t own;
  uint16_t other;
  uint8_t direction;
};

/// What an evaluation keeps of a tile; depends only on the voxels in it and, the links, on the tiles around
/// it.
struct Tile {
  TileMask frontier{}, voids{};
  TileLabels frontier_labels, void_labels;
  int components = 0;                    ///< of the frontier within the tile
  VoidGraph graph;                       ///< void ellipsoids within the tile
  std::vector<TileLink> frontier_links;  ///< to frontiers of the tiles ahead (directions above 13)
  std::vector<TileLink> void_links;      ///< to voids of the tiles ahead
  std::vector<TileLink> frontier_voids;  ///< own: frontier component, other: void node
  std::vector<int> cluster;              ///< per component its frontier cluster
  std::vector<int> ellipsoid;            ///< per void node its ellipsoid
};

/// Direction number of a step between tiles.
inline int tileDirection(int dx, int dy, int dz) { return (dx + 1) + 3 * (dy + 1) + 9 * (dz + 1); }
inline Voxel directionStep(int d) { return {d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1}; }

/// Voxels of a mask, ascending by voxelId.
std::vector<Voxel> maskVoxels(const TileMask& mask, const Voxel& corner);
int maskCount(const TileMask& mask);
bool maskEmpty(const TileMask& mask);

/// 26-connected components of a mask; returns their number.
int labelComponents(const TileMask& mask, TileLabels& labels);

/// Cluster the voids of a tile: one ellipsoid when all of them are connected and fit one, else seeding and
/// merging.
VoidGraph clusterTile(const TileMask& voids, const Voxel& corner, const ClusterRule& rule,
                      TileLabels& labels);

/// Labels `own` (with voxels `mask`) next to labels around: `around[d]` are the labels of the tile in
/// direction d, nullptr for none. Only directions from `first` on are looked at. Each link once.
std::vector<TileLink> linksAround(const TileMask& mask, const TileLabels& own,
                                  const std::array<const TileLabels*, 27>& around, int first);

}  // namespace fv
