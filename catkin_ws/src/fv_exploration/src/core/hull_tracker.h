#pragma once
#include <cstdint>
#include <vector>

#include "convex_hull.h"

namespace fv {

/// The convex hull of the occupied voxels, kept up to date with what becomes occupied or ceases to be.
class HullTracker {
 public:
  explicit HullTracker(const GridFrame& frame);

  /// A voxel that became occupied, or ceased to be, where that may move an end of its row.
  struct End {
    Voxel voxel;
    bool occupied;
  };
  /// Of voxels of a row those that `note` must hear of.
  /// @param start first voxel of a tile's row. @param appeared, vanished occupied voxels, as bits.
  void findEnds(const Voxel& start, unsigned appeared, unsigned vanished, std::vector<End>& ends) const;

  /// Take them over. @param classes of all voxels as they are now, in the low two bits, by index of the
  /// frame.
  void note(const std::vector<End>& ends, const std::vector<uint8_t>& classes);

  /// Bring the hull up to date with what was noted. @param[in,out] stale by tile: 1 where it gains or loses
  /// voxels.
  void update(std::vector<uint8_t>& stale);

  const HullRows& hull() const { return hull_; }

 private:
  void note(const End& end, const std::vector<uint8_t>& classes);
  void markRow(const HullRows::Before& before, std::vector<uint8_t>& stale) const;

  HullRows hull_;
  RowExtremes occupied_;
  std::vector<uint64_t> corners_;  // of the hull: voxelIds, ascending
  std::vector<Voxel> grows_;       // voxels that became occupied outside of it
  bool shrinks_ = false;           // it must be made anew
};

}  // namespace fv
