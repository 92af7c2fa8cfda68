#include "tile_store.h"

#include <algorithm>
#include <atomic>

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

TileMask frontierMask(int t, const TileLayout& layout, const VoxelClasses& classes, bool bounded) {
  static const TileMask kNothing{}, kEverything = [] {
    TileMask mask;
    mask.fill(0xffff);
    return mask;
  }();
  const TileMask& free = classes.masks(t).free;
  TileMask out{};
  if (maskEmpty(free)) return out;
  const std::array<int, 27> tiles = layout.neighbours(t);
  std::array<const TileMask*, 27> around;
  for (int d = 0; d < 27; ++d)
    around[d] = tiles[d] >= 0 ? &classes.masks(tiles[d]).unknown : bounded ? &kNothing : &kEverything;
  std::array<uint32_t, 18 * 18> rows, beside;  // with their neighbours along x, and those along y
  unknownRows(around, rows);
  for (uint32_t& row : rows) row |= row << 1 | row >> 1;
  for (std::size_t i = 1; i + 1 < rows.size(); ++i) beside[i] = rows[i - 1] | rows[i] | rows[i + 1];
  for (int z = 0; z < kTile; ++z)
    for (int y = 0; y < kTile; ++y) {
      const int i = (y + 1) + 18 * (z + 1);
      const uint32_t near = beside[i - 18] | beside[i] | beside[i + 18];
      out[y + kTile * z] = static_cast<uint16_t>(near >> 1) & free[y + kTile * z];
    }
  return out;
}

TileMask voidMask(int t, const TileLayout& layout, const VoxelClasses& classes, const HullRows& hull) {
  TileMask out;
  const Voxel corner = layout.corner(t);
  for (int row = 0; row < kTile * kTile; ++row) {
    const std::size_t r = hull.row(corner.y() + row % kTile, corner.z() + row / kTile);
    out[row] = classes.masks(t).unknown[row] & intervalRow(corner.x(), hull.low[r], hull.high[r]);
  }
  return out;
}

TileStore::TileStore(const TileLayout& layout)
    : layout_(layout), tiles_(layout.count()), components_(layout.count(), 0), labels_(layout.count(), 0) {}

void TileStore::refreshFrontiers(const std::vector<uint8_t>& stale, VoxelClasses& classes, bool bounded,
                                 int threads, const std::function<void()>& beside) {
  frontier_touched_.assign(tiles_.size(), 0);
  const std::vector<int> list = marked(stale);
  std::atomic<int64_t> gained{0};
  parallelChunks(static_cast<int>(list.size()) + 1, threads, 1, [&](int i, int, int) {
    if (i == 0)
      beside();
    else
      gained += refreshFrontier(list[i - 1], classes, bounded);
  });
  frontier_voxels_ += gained;
}

void TileStore::refreshVoids(const std::vector<uint8_t>& stale, VoxelClasses& classes, const HullRows& hull,
                             const ClusterRule* rule, int threads) {
  void_touched_.assign(tiles_.size(), 0);
  const std::vector<int> list = marked(stale);
  std::atomic<int64_t> gained{0};
  parallelChunks(static_cast<int>(list.size()), threads, 1,
                 [&](int i, int, int) { gained += refreshVoid(list[i], classes, hull, rule); });
  void_voxels_ += gained;
}

/// Give the frontier or the voids of a tile another mask.
/// @param label (tile, new mask) labels it; called when the mask has changed.
/// @return how many voxels it has gained.
template <class Label>
int TileStore::refresh(int t, LabelledMask Tile::*part, const TileMask& mask, uint8_t flag,
                       VoxelClasses& classes, const Label& label) {
  if (!tiles_[t] && !maskEmpty(mask)) tiles_[t] = std::make_unique<Tile>();
  if (!tiles_[t] || (tiles_[t].get()->*part).mask == mask) return 0;
  LabelledMask& now = tiles_[t].get()->*part;
  classes.writeFlag(t, now.mask, mask, flag);
  LabelledMask next;
  next.mask = mask;
  next.count = maskCount(mask);
  label(*tiles_[t], next);
  const int gained = next.count - now.count;
  now = std::move(next);
  return gained;
}

int TileStore::refreshFrontier(int t, VoxelClasses& classes, bool bounded) {
  const TileMask mask = frontierMask(t, layout_, classes, bounded);
  return refresh(t, &Tile::frontier, mask, kFrontierFlag, classes, [&](Tile& tile, LabelledMask& next) {
    components_[t] = next.labels = labelComponents(next.mask, next.runs);
    frontier_touched_[t] = changedDirections(tile.frontier, next);
  });
}

int TileStore::refreshVoid(int t, VoxelClasses& classes, const HullRows& hull, const ClusterRule* rule) {
  const TileMask mask = voidMask(t, layout_, classes, hull);
  return refresh(t, &Tile::voids, mask, kVoidFlag, classes, [&](Tile& tile, LabelledMask& next) {
    if (!rule) return;
    tile.graph = clusterTile(next.mask, layout_.corner(t), *rule, next.runs);
    labels_[t] = next.labels = static_cast<int>(tile.graph.nodes.size());
    void_touched_[t] = changedDirections(tile.voids, next);
  });
}

/// Directions in which links of a tile are to be found anew, as bits.
struct TileStore::StaleLinks {
  uint32_t frontiers = 0, voids = 0, frontier_voids = 0;
  bool any() const { return frontiers | voids | frontier_voids; }
};

/// By tile what sees changed labels, its own or those of a tile next to it.
std::vector<TileStore::StaleLinks> TileStore::staleLinks() const {
  constexpr uint32_t kAhead = ~0u << 14;
  std::vector<StaleLinks> stale(tiles_.size());
  for (int t = 0; t < layout_.count(); ++t) {
    const uint32_t frontier = frontier_touched_[t], voids = void_touched_[t];
    if (!(frontier | voids)) continue;
    stale[t].frontiers |= frontier & kAhead;
    stale[t].voids |= voids & kAhead;
    stale[t].frontier_voids |= frontier;
    const std::array<int, 27> around = layout_.neighbours(t);
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
  return stale;
}

std::vector<uint8_t> TileStore::relink(int threads) {
  std::vector<uint8_t> stale_groups(layout_.groups.size(), 0);
  const std::vector<StaleLinks> stale = staleLinks();
  std::vector<int> list;
  for (int t = 0; t < layout_.count(); ++t)
    if (stale[t].any() && tiles_[t]) {
      list.push_back(t);
      stale_groups[layout_.group_of[t]] = 1;
    }
  parallelChunks(static_cast<int>(list.size()), threads, 4, [&](int begin, int end, int) {
    for (int i = begin; i < end; ++i) relinkTile(list[i], stale[list[i]]);
  });
  return stale_groups;
}

void TileStore::relinkTile(int t, const StaleLinks& stale) {
  Tile& tile = *tiles_[t];
  const std::array<int, 27> around = layout_.neighbours(t);
  std::array<const LabelledMask*, 27> frontiers{}, voids{};
  for (int d = 0; d < 27; ++d) {
    const int n = around[d];
    if (n < 0 || !tiles_[n]) continue;
    if (tiles_[n]->frontier.count) frontiers[d] = &tiles_[n]->frontier;
    if (tiles_[n]->voids.count) voids[d] = &tiles_[n]->voids;
  }
  fv::relink(tile.frontier, frontiers, stale.frontiers, tile.frontier_links);
  fv::relink(tile.voids, voids, stale.voids, tile.void_links);
  fv::relink(tile.frontier, voids, stale.frontier_voids, tile.frontier_voids);
}

std::vector<Voxel> TileStore::voids() const {
  std::vector<Voxel> out;
  for (int t = 0; t < layout_.count(); ++t)
    if (tiles_[t]) {
      const std::vector<Voxel> some = maskVoxels(tiles_[t]->voids.mask, layout_.corner(t));
      out.insert(out.end(), some.begin(), some.end());
    }
  std::sort(out.begin(), out.end(), [](const Voxel& a, const Voxel& b) { return voxelId(a) < voxelId(b); });
  return out;
}

std::vector<std::vector<int>> TileStore::relabelVoids(const std::vector<Voxel>& voids,
                                                      const std::vector<int>& labels) {
  std::vector<std::vector<int>> own(tiles_.size()), stand_for(tiles_.size());
  for (std::size_t i = 0; i < voids.size(); ++i) {
    std::vector<int>& known = stand_for[layout_.frame.tileOf(voids[i])];
    auto found = std::find(known.begin(), known.end(), labels[i]);
    if (found == known.end()) found = known.insert(found, labels[i]);
    own[layout_.frame.tileOf(voids[i])].push_back(static_cast<int>(found - known.begin()));
  }
  for (int t = 0; t < layout_.count(); ++t) {
    labels_[t] = static_cast<int>(stand_for[t].size());
    if (!tiles_[t]) continue;
    void_touched_[t] = (1u << 27) - 1;
    tiles_[t]->voids.runs = runsOf(tiles_[t]->voids.mask, own[t]);
    tiles_[t]->voids.labels = labels_[t];
  }
  return stand_for;
}

}  // namespace fv
