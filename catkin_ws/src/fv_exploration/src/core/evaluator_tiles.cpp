// The part of Evaluator that makes frontiers and voids of classes, labels them and links the labels of
// neighbouring tiles.
#include <algorithm>
#include <atomic>
#include <cstring>

#include "fv_exploration/evaluator.h"
#include "marked_tiles.h"
#include "parallel.h"
#include "row_classes.h"

namespace fv {

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

}  // namespace

/// Free voxels with an unknown neighbour.
TileMask Evaluator::frontierMask(int t) const {
  static const TileMask kNothing{}, kEverything = [] {
    TileMask mask;
    mask.fill(0xffff);
    return mask;
  }();
  TileMask out{};
  if (maskEmpty(classes_[t].free)) return out;
  const std::array<int, 27> tiles = neighbours(t);
  std::array<const TileMask*, 27> around;
  for (int d = 0; d < 27; ++d) {
    const int n = tiles[d];
    around[d] = n >= 0 ? &classes_[n].unknown : map_.bounded() ? &kNothing : &kEverything;
  }
  std::array<uint32_t, 18 * 18> rows, beside;  // with their neighbours along x, and those along y
  unknownRows(around, rows);
  for (uint32_t& row : rows) row |= row << 1 | row >> 1;
  for (std::size_t i = 1; i + 1 < rows.size(); ++i) beside[i] = rows[i - 1] | rows[i] | rows[i + 1];
  for (int z = 0; z < kTile; ++z)
    for (int y = 0; y < kTile; ++y) {
      const int i = (y + 1) + 18 * (z + 1);
      const uint32_t near = beside[i - 18] | beside[i] | beside[i + 18];
      out[y + kTile * z] = static_cast<uint16_t>(near >> 1) & classes_[t].free[y + kTile * z];
    }
  return out;
}

/// Unknown voxels inside the hull.
TileMask Evaluator::voidMask(int t) const {
  TileMask out;
  const Voxel corner = tileCorner(t);
  for (int row = 0; row < kTile * kTile; ++row) {
    const std::size_t r = hull_.row(corner.y() + row % kTile, corner.z() + row / kTile);
    out[row] = classes_[t].unknown[row] & intervalRow(corner.x(), hull_.low[r], hull_.high[r]);
  }
  return out;
}

/// Update the frontiers of some tiles; beside it, since it does not touch them, the hull.
/// @param stale tiles whose frontiers are to be updated. @param[in,out] stale_voids then also those in which
/// the hull has changed.
void Evaluator::refreshFrontiers(const std::vector<uint8_t>& stale, std::vector<uint8_t>& stale_voids) {
  frontier_touched_.assign(tiles_.size(), 0);
  const std::vector<int> list = marked(stale);
  std::atomic<int64_t> gained{0};
  parallelChunks(static_cast<int>(list.size()) + 1, threadCount(config_.threads), 1, [&](int i, int, int) {
    if (i == 0)
      updateHull(stale_voids);
    else
      gained += refreshFrontier(list[i - 1]);
  });
  frontier_voxels_ += gained;
  evaluation_->counts["tiles_stale"] = static_cast<int64_t>(list.size());
}

void Evaluator::refreshVoids(const std::vector<uint8_t>& stale) {
  void_touched_.assign(tiles_.size(), 0);
  const std::vector<int> list = marked(stale);
  std::atomic<int64_t> gained{0};
  parallelChunks(static_cast<int>(list.size()), threadCount(config_.threads), 1,
                 [&](int i, int, int) { gained += refreshVoid(list[i]); });
  void_voxels_ += gained;
}

/// Give the frontier or the voids of a tile another mask.
/// @param label (tile, new mask) labels it; called when the mask has changed.
/// @return how many voxels it has gained.
template <class Label>
int Evaluator::refresh(int t, LabelledMask Tile::*part, const TileMask& mask, uint8_t flag,
                       const Label& label) {
  if (!tiles_[t] && !maskEmpty(mask)) tiles_[t] = std::make_unique<Tile>();
  if (!tiles_[t] || (tiles_[t].get()->*part).mask == mask) return 0;
  LabelledMask& now = tiles_[t].get()->*part;
  writeFlags(t, now.mask, mask, flag);
  LabelledMask next;
  next.mask = mask;
  next.count = maskCount(mask);
  label(*tiles_[t], next);
  const int gained = next.count - now.count;
  now = std::move(next);
  return gained;
}

int Evaluator::refreshFrontier(int t) {
  return refresh(t, &Tile::frontier, frontierMask(t), kFrontierFlag, [&](Tile& tile, LabelledMask& next) {
    components_[t] = next.labels = labelComponents(next.mask, next.runs);
    frontier_touched_[t] = changedDirections(tile.frontier, next);
  });
}

int Evaluator::refreshVoid(int t) {
  return refresh(t, &Tile::voids, voidMask(t), kVoidFlag, [&](Tile& tile, LabelledMask& next) {
    if (!config_.tiled) return;  // clusterWhole labels them
    tile.graph = clusterTile(next.mask, tileCorner(t), rule(), next.runs);
    labels_[t] = next.labels = static_cast<int>(tile.graph.nodes.size());
    void_touched_[t] = changedDirections(tile.voids, next);
  });
}

/// Write a flag in the rows of a tile in which its mask changes.
void Evaluator::writeFlags(int t, const TileMask& before, const TileMask& after, uint8_t flag) {
  constexpr uint64_t kOnes = 0x0101010101010101u;
  for (int row = 0; row < kTile * kTile; ++row) {
    if (before[row] == after[row]) continue;
    uint8_t* cells = &flags_[frame_.index(tileCorner(t) + Voxel(0, row % kTile, row / kTile))];
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

/// Directions in which links of a tile are to be found anew, as bits.
struct Evaluator::StaleLinks {
  uint32_t frontiers = 0, voids = 0, frontier_voids = 0;
  bool any() const { return frontiers | voids | frontier_voids; }
};

/// Find anew the links of tiles that see changed labels, their own or those of a tile next to them.
/// @param[out] stale_groups that such tiles belong to.
void Evaluator::relinkTiles(std::vector<uint8_t>& stale_groups) {
  constexpr uint32_t kAhead = ~0u << 14;
  std::vector<StaleLinks> stale(tiles_.size());
  for (int t = 0; t < static_cast<int>(tiles_.size()); ++t) {
    const uint32_t frontier = frontier_touched_[t], voids = void_touched_[t];
    if (!(frontier | voids)) continue;
    stale[t].frontiers |= frontier & kAhead;
    stale[t].voids |= voids & kAhead;
    stale[t].frontier_voids |= frontier;
    const std::array<int, 27> around = neighbours(t);
    for (int d = 0; d < 27; ++d) {
      const int n = around[d];
      if (n < 0) continue;
      const uint32_t back = 1u << (26 - d);  // the direction in which it sees this tile
      if (frontier >> d & 1) stale[n].frontiers |= back & kAhead;
      if (voids >> d & 1) {
        stale[n].voids |= back & kAhead;
        stale[n].frontier_voids |= back;
      }
    }
  }
  std::vector<int> list;
  for (int t = 0; t < static_cast<int>(tiles_.size()); ++t)
    if (stale[t].any() && tiles_[t]) {
      list.push_back(t);
      stale_groups[group_of_[t]] = 1;
    }
  parallelChunks(static_cast<int>(list.size()), threadCount(config_.threads), 4,
                 [&](int begin, int end, int) {
                   for (int i = begin; i < end; ++i) relinkTile(list[i], stale[list[i]]);
                 });
}

void Evaluator::relinkTile(int t, const StaleLinks& stale) {
  Tile& tile = *tiles_[t];
  const std::array<int, 27> around = neighbours(t);
  std::array<const LabelledMask*, 27> frontiers{}, voids{};
  for (int d = 0; d < 27; ++d) {
    const int n = around[d];
    if (n < 0 || !tiles_[n]) continue;
    if (tiles_[n]->frontier.count) frontiers[d] = &tiles_[n]->frontier;
    if (tiles_[n]->voids.count) voids[d] = &tiles_[n]->voids;
  }
  relink(tile.frontier, frontiers, stale.frontiers, tile.frontier_links);
  relink(tile.voids, voids, stale.voids, tile.void_links);
  relink(tile.frontier, voids, stale.frontier_voids, tile.frontier_voids);
}

}  // namespace fv
