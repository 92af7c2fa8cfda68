// The part of Evaluator that makes frontiers and voids of classes, labels them and links the labels of
// neighbouring tiles.
#include <algorithm>

#include "fv_exploration/evaluator.h"
#include "fv_exploration/parallel.h"
#include "marked_tiles.h"

namespace fv {

/// Frontier and void voxels of a tile.
struct Evaluator::TileMasks {
  TileMask frontier, voids;
};

namespace {

/// The unknown voxels of a tile and of a margin of one around it: rows of 18 bits, bit 0 at x = -1.
/// @param around unknown voxels of the tiles in each direction.
void unknownRows(const std::array<const TileMask*, 27>& around, std::array<uint32_t, 18 * 18>& rows) {
  const auto part = [](int c) { return c < 0 ? -1 : c >= kTile ? 1 : 0; };
  for (int z = -1; z <= kTile; ++z)
    for (int y = -1; y <= kTile; ++y) {
      const int straight = tileDirection(0, part(y), part(z));
      const int row = (y & (kTile - 1)) + kTile * (z & (kTile - 1));
      rows[(y + 1) + 18 * (z + 1)] = uint32_t{(*around[straight])[row]} << 1 |
                                     uint32_t{(*around[straight - 1])[row]} >> (kTile - 1) |
                                     (uint32_t{(*around[straight + 1])[row]} & 1) << (kTile + 1);
    }
}

/// Bits of a row along x that lie within [low, high].
uint16_t intervalRow(int start, int low, int high) {
  const int from = std::max(low - start, 0), to = std::min(high - start, kTile - 1);
  if (low > high || from > to) return 0;
  return static_cast<uint16_t>(((2u << to) - 1) & ~((1u << from) - 1));
}

}  // namespace

/// What the masks of a tile are now.
void Evaluator::readMasks(int t, TileMasks& masks) const {
  static const TileMask kNothing{}, kEverything = [] {
    TileMask mask;
    mask.fill(0xffff);
    return mask;
  }();
  std::array<const TileMask*, 27> around;
  for (int d = 0; d < 27; ++d) {
    const int n = neighbourIndex(t, d);
    around[d] = n >= 0 ? &classes_[n].unknown : map_.bounded() ? &kNothing : &kEverything;
  }
  std::array<uint32_t, 18 * 18> unknown, wide;
  unknownRows(around, unknown);
  for (std::size_t i = 0; i < unknown.size(); ++i) wide[i] = unknown[i] | unknown[i] << 1 | unknown[i] >> 1;
  const Voxel corner = tileCorner(t);
  for (int z = 0; z < kTile; ++z)
    for (int y = 0; y < kTile; ++y) {
      uint32_t near = 0;
      for (int dz = 0; dz < 3; ++dz)
        for (int dy = 0; dy < 3; ++dy) near |= wide[(y + dy) + 18 * (z + dz)];
      const int row = y + kTile * z;
      masks.frontier[row] = static_cast<uint16_t>(near >> 1) & classes_[t].free[row];
      const std::size_t r = hull_.row(corner.y() + y, corner.z() + z);
      masks.voids[row] = classes_[t].unknown[row] & intervalRow(corner.x(), hull_.low[r], hull_.high[r]);
    }
}

void Evaluator::refreshTiles(const std::vector<uint8_t>& stale) {
  frontier_touched_.assign(tiles_.size(), 0);
  void_touched_.assign(tiles_.size(), 0);
  const std::vector<int> list = marked(stale);
  const int count = static_cast<int>(list.size()), threads = threadCount(config_.threads);
  std::vector<TileMasks> masks(list.size());
  parallelChunks(count, threads, 4, [&](int begin, int end, int) {
    for (int i = begin; i < end; ++i) readMasks(list[i], masks[i]);
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
