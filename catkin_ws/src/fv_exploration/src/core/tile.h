#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "fv_exploration/grid.h"
#include "void_clusters.h"

namespace fv {

/// One bit per voxel of a tile: rows along x, by y + 16 z.
using TileMask = std::array<uint16_t, kTile * kTile>;

/// Bits of a row that are set; not every machine counts them in one instruction.
inline int bitCount(unsigned row) {
  row -= row >> 1 & 0x5555;
  row = (row & 0x3333) + (row >> 2 & 0x3333);
  row = (row + (row >> 4)) & 0x0f0f;
  return static_cast<int>((row + (row >> 8)) & 0x1f);
}

/// A label of each voxel of a mask. Voxels that follow each other in a row and have the same label are a run;
/// runs are numbered row by row.
struct RunLabels {
  TileMask starts{};                            ///< first voxel of each run
  std::array<uint16_t, kTile * kTile> first{};  ///< number of the first run of a row
  std::vector<uint16_t> labels;                 ///< by run
  /// Label of a voxel of the mask. @param row y + 16 z.
  int at(int row, int x) const { return labels[first[row] + bitCount(starts[row] & ((2u << x) - 1)) - 1]; }
};

/// Some voxels of a tile and what each belongs to.
struct LabelledMask {
  TileMask mask{};
  RunLabels runs;
  int count = 0;   ///< voxels
  int labels = 0;  ///< how many different ones
};

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
  LabelledMask frontier;                 ///< labels: components within the tile
  LabelledMask voids;                    ///< labels: nodes of `graph`
  VoidGraph graph;                       ///< void ellipsoids within the tile
  std::vector<TileLink> frontier_links;  ///< to frontiers of the tiles ahead (directions above 13)
  std::vector<TileLink> void_links;      ///< to voids of the tiles ahead
  std::vector<TileLink> frontier_voids;  ///< own: frontier component, other: void node
};

/// Direction number of a step between tiles.
inline int tileDirection(int dx, int dy, int dz) { return (dx + 1) + 3 * (dy + 1) + 9 * (dz + 1); }
inline Voxel directionStep(int d) { return {d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1}; }

/// Directions whose tiles touch a voxel of a tile, as bits; bit 13, the tile itself, always.
uint32_t touchedDirections(int x, int y, int z);

/// Voxels of a mask, ascending by voxelId.
std::vector<Voxel> maskVoxels(const TileMask& mask, const Voxel& corner);
/// Call visit(voxel, label) for each voxel of a mask, ascending by voxelId.
template <class Visit>
void forEachLabel(const LabelledMask& of, const Voxel& corner, const Visit& visit) {
  for (int row = 0; row < kTile * kTile; ++row)
    for (unsigned bits = of.mask[row]; bits; bits &= bits - 1) {
      const int x = __builtin_ctz(bits);
      visit(Voxel(corner + Voxel(x, row % kTile, row / kTile)), of.runs.at(row, x));
    }
}
int maskCount(const TileMask& mask);
bool maskEmpty(const TileMask& mask);

/// 26-connected components of a mask, numbered by their first voxels; returns how many.
int labelComponents(const TileMask& mask, RunLabels& runs);

/// Runs of voxels that have their labels already.
/// @param labels of the voxels of the mask, ascending by voxelId.
RunLabels runsOf(const TileMask& mask, const std::vector<int>& labels);

/// Cluster the voids of a tile: a connected component that fits one ellipsoid is one, in others seeding and
/// merging.
/// @param[out] runs labels: nodes of the graph, which ascend by id.
VoidGraph clusterTile(const TileMask& voids, const Voxel& corner, const ClusterRule& rule, RunLabels& runs);

/// Directions whose tiles see that labels have changed, as bits.
uint32_t changedDirections(const LabelledMask& before, const LabelledMask& after);

/// Find anew the links of `own` in some directions. @param around by direction the masks of the tiles there,
/// nullptr for none. @param which directions, as bits. @param[in,out] links in order of direction, each once.
void relink(const LabelledMask& own, const std::array<const LabelledMask*, 27>& around, uint32_t which,
            std::vector<TileLink>& links);

}  // namespace fv
