// The part of Evaluator that reads masks off the flags, labels them and links the labels of neighbouring
// tiles.
#include <algorithm>
#include <cstring>

#include "fv_exploration/evaluator.h"
#include "fv_exploration/parallel.h"
#include "marked_tiles.h"

namespace fv {

/// Frontier and void voxels of a tile.
struct Evaluator::TileMasks {
  TileMask frontier, voids;
};

namespace {

/// Eight bytes of 0 or 1 as bits, the first byte lowest.
unsigned gather(uint64_t bytes) { return static_cast<unsigned>(bytes * 0x0102040810204080u >> 56); }

/// Which of 16 cells are unknown, and which are free.
struct RowClasses {
  unsigned unknown = 0, free = 0;
  explicit RowClasses(const uint8_t* cells) {
    static_assert(kUnknown == 0 && kFree == 1 && kOccupied == 2 && kOutside == 3, "the two bits of a class");
    constexpr uint64_t kOnes = 0x0101010101010101u;
    for (int half = 0; half < 2; ++half) {
      uint64_t w;
      std::memcpy(&w, cells + 8 * half, 8);
      unknown |= gather(~(w | w >> 1) & kOnes) << (8 * half);
      free |= gather(w & ~(w >> 1) & kOnes) << (8 * half);
    }
  }
};

/// The unknown voxels of a tile and of a margin of one around it: rows of 18 bits, bit 0 at x = -1.
void unknownRows(const GridFrame& frame, const std::vector<uint8_t>& flags, const Voxel& corner, bool beyond,
                 std::array<uint32_t, 18 * 18>& rows, TileMask& free) {
  const bool first = corner.x() > frame.origin.x(), last = corner.x() + kTile < frame.end().x();
  for (int z = -1; z <= kTile; ++z)
    for (int y = -1; y <= kTile; ++y) {
      const Voxel start = corner + Voxel(0, y, z);
      uint32_t& row = rows[(y + 1) + 18 * (z + 1)];
      row = beyond ? (1u << 18) - 1 : 0;
      if (!frame.contains(start)) continue;
      const uint8_t* cells = &flags[frame.index(start)];
      const auto unknown = [&](int x) { return (cells[x] & Evaluator::kClassMask) == kUnknown; };
      const RowClasses classes(cells);
      row = classes.unknown << 1;
      row |= uint32_t{first ? unknown(-1) : beyond};
      row |= uint32_t{last ? unknown(kTile) : beyond} << 17;
      if (y >= 0 && y < kTile && z >= 0 && z < kTile)
        free[y + kTile * z] = static_cast<uint16_t>(classes.free);
    }
}

/// Bits of a row along x that lie within [low, high].
uint16_t intervalRow(int start, int low, int high) {
  const int from = std::max(low - start, 0), to = std::min(high - start, kTile - 1);
  if (low > high || from > to) return 0;
  return static_cast<uint16_t>(((2u << to) - 1) & ~((1u << from) - 1));
}

/// Frontier and void voxels of a tile.
void tileMasks(const GridFrame& frame, const std::vector<uint8_t>& flags, const HullRows& hull,
               const Voxel& corner, bool beyond, TileMask& frontier, TileMask& voids) {
  std::array<uint32_t, 18 * 18> unknown, wide;
  TileMask free;
  unknownRows(frame, flags, corner, beyond, unknown, free);
  for (std::size_t i = 0; i < unknown.size(); ++i) wide[i] = unknown[i] | unknown[i] << 1 | unknown[i] >> 1;
  for (int z = 0; z < kTile; ++z)
    for (int y = 0; y < kTile; ++y) {
      uint32_t near = 0;
      for (int dz = 0; dz < 3; ++dz)
        for (int dy = 0; dy < 3; ++dy) near |= wide[(y + dy) + 18 * (z + dz)];
      const Voxel start = corner + Voxel(0, y, z);
      frontier[y + kTile * z] = static_cast<uint16_t>(near >> 1) & free[y + kTile * z];
      const std::size_t r = hull.row(start.y(), start.z());
      voids[y + kTile * z] = static_cast<uint16_t>(unknown[(y + 1) + 18 * (z + 1)] >> 1) &
                             intervalRow(start.x(), hull.low[r], hull.high[r]);
    }
}

}  // namespace

void Evaluator::refreshTiles(const std::vector<uint8_t>& stale) {
  frontier_touched_.assign(tiles_.size(), 0);
  void_touched_.assign(tiles_.size(), 0);
  const std::vector<int> list = marked(stale);
  const int count = static_cast<int>(list.size()), threads = threadCount(config_.threads);
  std::vector<TileMasks> masks(list.size());
  // First all masks are read off the flags, then each tile's own flags are written.
  parallelChunks(count, threads, 4, [&](int begin, int end, int) {
    for (int i = begin; i < end; ++i)
      tileMasks(frame_, flags_, hull_, tileCorner(list[i]), !map_.bounded(), masks[i].frontier,
                masks[i].voids);
  });
  const auto addCounts = [&](int sign) {
    for (const int t : list)
      if (tiles_[t]) {
        frontier_voxels_ += sign * tiles_[t]->frontier.count;
        void_voxels_ += sign * tiles_[t]->voids.count;
      }
  };
  addCounts(-1);
  parallelChunks(count, threads, 1, [&](int begin, int end, int) {
    for (int i = begin; i < end; ++i) refreshTile(list[i], masks[i]);
  });
  addCounts(1);
  evaluation_->counts["tiles_stale"] = count;
}

void Evaluator::refreshTile(int t, const TileMasks& masks) {
  if (!tiles_[t]) {
    if (maskEmpty(masks.frontier) && maskEmpty(masks.voids)) return;
    tiles_[t] = std::make_unique<Tile>();
  }
  Tile& tile = *tiles_[t];
  writeFlags(t, masks);
  if (tile.frontier.mask != masks.frontier) {
    LabelledMask next;
    next.mask = masks.frontier;
    next.count = maskCount(next.mask);
    components_[t] = labelComponents(next.mask, next.runs);
    frontier_touched_[t] = changedDirections(tile.frontier, next);
    tile.frontier = std::move(next);
  }
  if (tile.voids.mask != masks.voids) {
    LabelledMask next;
    next.mask = masks.voids;
    next.count = maskCount(next.mask);
    if (config_.tiled) {
      tile.graph = clusterTile(next.mask, tileCorner(t), rule(), next.runs);
      nodes_[t] = static_cast<int>(tile.graph.nodes.size());
      void_touched_[t] = changedDirections(tile.voids, next);
    }
    tile.voids = std::move(next);
  }
}

/// Write the flags of a tile's rows whose masks are about to change.
void Evaluator::writeFlags(int t, const TileMasks& masks) {
  for (int row = 0; row < kTile * kTile; ++row) {
    if (masks.frontier[row] == tiles_[t]->frontier.mask[row] &&
        masks.voids[row] == tiles_[t]->voids.mask[row])
      continue;
    uint8_t* cells = &flags_[frame_.index(tileCorner(t) + Voxel(0, row % kTile, row / kTile))];
    for (int x = 0; x < kTile; ++x) {
      const int frontier = masks.frontier[row] >> x & 1, voids = masks.voids[row] >> x & 1;
      cells[x] = static_cast<uint8_t>((cells[x] & kClassMask) | frontier * kFrontierFlag | voids * kVoidFlag);
    }
  }
}

namespace {
enum Relink : uint8_t { kFrontierLinks = 1, kVoidLinks = 2, kFrontierVoids = 4 };
}  // namespace

/// Find anew the links of tiles that see changed labels: their own, or those of a tile next to them.
void Evaluator::relink() {
  std::vector<uint8_t> what(tiles_.size(), 0);
  const auto see = [&](int t, uint32_t touched, uint8_t links, uint8_t links_ahead) {
    for (int d = 0; d < 27; ++d) {
      if (!(touched >> d & 1)) continue;
      const int n = neighbourIndex(t, d);
      if (n < 0) continue;
      what[n] |= links;
      if (d < 13) what[n] |= links_ahead;  // to it the changed tile lies ahead
    }
  };
  for (int t = 0; t < static_cast<int>(tiles_.size()); ++t) {
    const uint32_t frontier = frontier_touched_[t], voids = void_touched_[t];
    constexpr uint32_t kItself = 1u << 13;
    if (frontier) what[t] |= kFrontierVoids | (frontier & ~kItself ? kFrontierLinks : 0);
    if (voids & ~kItself) what[t] |= kVoidLinks;
    see(t, frontier, 0, kFrontierLinks);
    see(t, voids, kFrontierVoids, kVoidLinks);
  }
  const std::vector<int> list = marked(what);
  parallelChunks(static_cast<int>(list.size()), threadCount(config_.threads), 2,
                 [&](int begin, int end, int) {
                   for (int i = begin; i < end; ++i)
                     if (tiles_[list[i]]) relinkTile(list[i], what[list[i]]);
                 });
}

void Evaluator::relinkTile(int t, uint8_t what) {
  Tile& tile = *tiles_[t];
  std::array<const LabelledMask*, 27> frontiers{}, voids{};
  for (int d = 0; d < 27; ++d) {
    const int n = neighbourIndex(t, d);
    if (n < 0 || !tiles_[n]) continue;
    if (tiles_[n]->frontier.count) frontiers[d] = &tiles_[n]->frontier;
    if (tiles_[n]->voids.count) voids[d] = &tiles_[n]->voids;
  }
  if (what & kFrontierLinks) tile.frontier_links = linksAround(tile.frontier, frontiers, 14);
  if (what & kVoidLinks) tile.void_links = linksAround(tile.voids, voids, 14);
  if (what & kFrontierVoids) tile.frontier_voids = linksAround(tile.frontier, voids, 0);
}

}  // namespace fv
