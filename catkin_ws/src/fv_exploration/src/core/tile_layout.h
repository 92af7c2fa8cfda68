#pragma once
#include <array>
#include <vector>

#include "tile.h"

namespace fv {

/// Where the tiles of a frame lie, and which groups of 4x4x4 they form.
struct TileLayout {
  GridFrame frame;
  std::array<int, 27> step_to{};         ///< of tile indices, by direction
  std::vector<int> group_of;             ///< by tile
  std::vector<std::vector<int>> groups;  ///< their tiles, ascending

  explicit TileLayout(const GridFrame& frame);
  int count() const { return static_cast<int>(group_of.size()); }
  Voxel corner(int tile) const { return frame.origin + frame.tile(tile) * kTile; }
  /// First voxel of a row along x. @param row y + 16 z.
  Voxel rowStart(int tile, int row) const { return corner(tile) + Voxel(0, row % kTile, row / kTile); }
  /// The tiles in all directions; -1 beyond the frame.
  std::array<int, 27> neighbours(int tile) const;
  bool sameGroup(int a, int b) const { return group_of[a] == group_of[b]; }
};

}  // namespace fv
