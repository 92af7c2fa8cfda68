#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "convex_hull.h"
#include "tile_layout.h"
#include "voxel_classes.h"

namespace fv {

/// Frontiers and voids of all tiles, their labels, and what labels of neighbouring tiles touch.
class TileStore {
 public:
  /// @param layout must outlive it.
  explicit TileStore(const TileLayout& layout);

  /// Make the frontiers of some tiles anew. @param bounded whether space beyond the frame is of no account;
  /// else it is unknown. @param beside done by one of the threads meanwhile.
  void refreshFrontiers(const std::vector<uint8_t>& stale, VoxelClasses& classes, bool bounded, int threads,
                        const std::function<void()>& beside);
  /// Make the voids of some tiles anew, and cluster them within each tile. @param rule nullptr: do not,
  /// relabelVoids is to follow.
  void refreshVoids(const std::vector<uint8_t>& stale, VoxelClasses& classes, const HullRows& hull,
                    const ClusterRule* rule, int threads);
  /// Link the labels that have changed. @return by group: 1 where links were made anew.
  std::vector<uint8_t> relink(int threads);

  /// Void voxels of all tiles, ascending by voxelId.
  std::vector<Voxel> voids() const;
  /// Give all voids other labels than those of their tiles. @param labels per voxel of `voids` its label;
  /// each tile numbers those that it has in the order in which its voxels come to them.
  /// @return by tile what its labels stand for.
  std::vector<std::vector<int>> relabelVoids(const std::vector<Voxel>& voids, const std::vector<int>& labels);

  const TileLayout& layout() const { return layout_; }
  /// nullptr: neither frontier nor voids, and never had.
  const Tile* at(int tile) const { return tiles_[tile].get(); }
  int components(int tile) const { return components_[tile]; }  ///< of its frontier
  int labels(int tile) const { return labels_[tile]; }          ///< of its voids
  /// Whether the last refreshVoids has changed labels of a tile.
  bool voidsTouched(int tile) const { return void_touched_[tile] != 0; }
  int64_t frontierVoxels() const { return frontier_voxels_; }
  int64_t voidVoxels() const { return void_voxels_; }

 private:
  struct StaleLinks;
  template <class Label>
  int refresh(int tile, LabelledMask Tile::*part, const TileMask& mask, uint8_t flag, VoxelClasses& classes,
              const Label& label);
  int refreshFrontier(int tile, VoxelClasses& classes, bool bounded);
  int refreshVoid(int tile, VoxelClasses& classes, const HullRows& hull, const ClusterRule* rule);
  std::vector<StaleLinks> staleLinks() const;
  void relinkTile(int tile, const StaleLinks& stale);

  const TileLayout& layout_;
  std::vector<std::unique_ptr<Tile>> tiles_;
  std::vector<int> components_, labels_;  // by tile: near each other in memory
  // By tile: directions whose tiles see labels that the last refresh has changed.
  std::vector<uint32_t> frontier_touched_, void_touched_;
  int64_t frontier_voxels_ = 0, void_voxels_ = 0;
};

/// Free voxels of a tile with an unknown neighbour.
TileMask frontierMask(int tile, const TileLayout& layout, const VoxelClasses& classes, bool bounded);
/// Unknown voxels of a tile inside the hull.
TileMask voidMask(int tile, const TileLayout& layout, const VoxelClasses& classes, const HullRows& hull);

}  // namespace fv
