#include "voxel_classes.h"

#include <algorithm>
#include <cstring>

#include "parallel.h"
#include "row_classes.h"

namespace fv {

/// What happened in a tile since the last reading.
struct VoxelClasses::TileChange {
  uint32_t touched = 0;               // bit per direction whose neighbours see a change of what is unknown
  bool any = false, unknown = false;  // whether classes have changed, and whether what is unknown has
  std::vector<HullTracker::End> ends;
};

VoxelClasses::VoxelClasses(const std::vector<uint8_t>& classes, const TileLayout& layout)
    : layout_(layout), flags_(classes.size()), masks_(layout.count()) {
  std::transform(classes.begin(), classes.end(), flags_.begin(),
                 [](uint8_t c) { return c == kOutside ? kOutside : kUnknown; });
  for (int t = 0; t < layout.count(); ++t)
    for (int row = 0; row < kTile * kTile; ++row)
      masks_[t].unknown[row] =
          static_cast<uint16_t>(RowClasses(&flags_[layout.frame.index(layout.rowStart(t, row))]).unknown);
}

VoxelClasses::Changes VoxelClasses::read(const OccupancyMap& map, const HullTracker& hull, int threads) {
  std::vector<int> candidates;
  for (int i = 0; i < layout_.count(); ++i)
    if (map.tileSequences()[i] > seen_sequence_) candidates.push_back(i);
  const bool all_rows = seen_sequence_ + 1 != map.sequence();  // else the map knows which
  std::vector<TileChange> changes(candidates.size());
  parallelChunks(static_cast<int>(candidates.size()), threads, 8, [&](int begin, int end, int) {
    for (int i = begin; i < end; ++i) readTile(map, hull, candidates[i], all_rows, changes[i]);
  });
  Changes out{std::vector<uint8_t>(layout_.count(), 0), std::vector<uint8_t>(layout_.count(), 0), {}};
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (changes[i].any) out.frontiers[candidates[i]] = 1;
    if (changes[i].unknown) {
      out.voids[candidates[i]] = 1;
      const std::array<int, 27> around = layout_.neighbours(candidates[i]);
      for (int d = 0; d < 27; ++d)
        if (changes[i].touched >> d & 1 && around[d] >= 0) out.frontiers[around[d]] = 1;
    }
    out.ends.insert(out.ends.end(), changes[i].ends.begin(), changes[i].ends.end());
  }
  seen_sequence_ = map.sequence();
  return out;
}

void VoxelClasses::readTile(const OccupancyMap& map, const HullTracker& hull, int tile, bool all_rows,
                            TileChange& change) {
  const Voxel corner = layout_.corner(tile);
  const OccupancyMap::RowSet& rows = map.changedRows(tile);
  Masks& known = masks_[tile];
  for (int row = 0; row < kTile * kTile; ++row) {
    if (!all_rows && !rows[row]) continue;
    const int y = row % kTile, z = row / kTile;
    const Voxel start = corner + Voxel(0, y, z);
    const std::size_t at = layout_.frame.index(start);
    const RowClasses now(&map.classes()[at]);
    const unsigned unknown = known.unknown[row], free = known.free[row];
    const unsigned differ = (unknown ^ now.unknown) | (free ^ now.free);
    if (!differ) continue;
    now.write(&flags_[at]);
    known.unknown[row] = static_cast<uint16_t>(now.unknown);
    known.free[row] = static_cast<uint16_t>(now.free);
    hull.findEnds(start, differ & now.occupied, differ & ~(unknown | free), change.ends);
    change.any = true;
    const unsigned seen = unknown ^ now.unknown;
    if (!seen) continue;
    change.unknown = true;
    change.touched |= touchedDirections(1, y, z);
    if (seen & 1) change.touched |= touchedDirections(0, y, z);
    if (seen >> (kTile - 1)) change.touched |= touchedDirections(kTile - 1, y, z);
  }
}

void VoxelClasses::writeFlag(int t, const TileMask& before, const TileMask& after, uint8_t flag) {
  constexpr uint64_t kOnes = 0x0101010101010101u;
  for (int row = 0; row < kTile * kTile; ++row) {
    if (before[row] == after[row]) continue;
    uint8_t* cells = &flags_[layout_.frame.index(layout_.rowStart(t, row))];
    for (int half = 0; half < 2; ++half) {
      // Eight bits as eight bytes: each byte keeps one of them, as any bit, and then as the lowest.
      const uint64_t bits = (after[row] >> 8 * half & 0xff) * kOnes & 0x8040201008040201u;
      const uint64_t bytes = ((bits + 0x7f * kOnes) | bits) >> 7 & kOnes;
      uint64_t w;
      std::memcpy(&w, cells + 8 * half, 8);
      w = (w & ~(flag * kOnes)) | flag * bytes;
      std::memcpy(cells + 8 * half, &w, 8);
    }
  }
}

}  // namespace fv
