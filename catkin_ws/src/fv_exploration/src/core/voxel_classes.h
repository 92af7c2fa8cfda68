#pragma once
#include <cstdint>
#include <vector>

#include "fv_exploration/occupancy_map.h"
#include "hull_tracker.h"
#include "tile_layout.h"

namespace fv {

/// The map's classes as an evaluation has last read them: by voxel, with room for its flags beside them, and
/// as bits by tile.
class VoxelClasses {
 public:
  /// Nothing read yet: all unknown but for what lies outside.
  /// @param classes of the map, by index of the frame. @param layout must outlive it.
  VoxelClasses(const std::vector<uint8_t>& classes, const TileLayout& layout);

  /// What a reading has found to be stale.
  struct Changes {
    std::vector<uint8_t> frontiers, voids;  ///< by tile: 1 where they are to be made anew
    std::vector<HullTracker::End> ends;
  };
  /// Take over what has changed in the map. @param hull of what was occupied before.
  Changes read(const OccupancyMap& map, const HullTracker& hull, int threads);

  /// The others of a tile's voxels are occupied, or outside.
  struct Masks {
    TileMask unknown{}, free{};
  };
  const Masks& masks(int tile) const { return masks_[tile]; }
  /// Class in the low two bits, kFrontierFlag, kVoidFlag; by index of the frame.
  const std::vector<uint8_t>& flags() const { return flags_; }
  /// Write a flag in the rows of a tile in which its mask changes.
  void writeFlag(int tile, const TileMask& before, const TileMask& after, uint8_t flag);

 private:
  struct TileChange;
  void readTile(const OccupancyMap& map, const HullTracker& hull, int tile, bool all_rows,
                TileChange& change);

  const TileLayout& layout_;
  std::vector<uint8_t> flags_;
  std::vector<Masks> masks_;  // as the flags, but near each other in memory
  uint64_t seen_sequence_ = 0;
};

}  // namespace fv
