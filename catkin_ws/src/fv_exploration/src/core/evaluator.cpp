#include "fv_exploration/evaluator.h"

#include <algorithm>
#include <chrono>
#include <climits>
#include <cmath>
#include <cstring>

#include "fv_exploration/parallel.h"
#include "marked_tiles.h"

namespace fv {

namespace {

class Stopwatch {
 public:
  explicit Stopwatch(std::map<std::string, double>& timings) : timings_(timings) {}
  void lap(const char* name) {
    const auto now = std::chrono::steady_clock::now();
    timings_[name] = std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  std::map<std::string, double>& timings_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

void EvaluationConfig::validate() const {
  require(min_fit > 0 && min_fit <= 1, "min_fit", min_fit, "above 0, at most 1");
  require(seed_share >= 0 && seed_share <= 1, "seed_share", seed_share, "0 to 1");
  require(threads >= 0 && threads <= 256, "threads", threads, "0 (all cores) to 256");
}

/// What happened in a tile since the last update.
struct Evaluator::TileChange {
  uint32_t touched = 0;  // bit per direction whose neighbours see a change; 13: the tile itself
  std::vector<std::pair<Voxel, bool>> occupied;  // became occupied, or ceased to be
};

Evaluator::Evaluator(const OccupancyMap& map, const EvaluationConfig& config) : map_(map), config_(config) {
  config_.validate();
}

ClusterRule Evaluator::rule() const {
  return {{map_.resolution(), config_.literal_formula}, config_.min_fit, config_.seed, config_.seed_share};
}

void Evaluator::reset() {
  frame_ = map_.frame();
  flags_.assign(frame_.size(), kUnknown);
  for (std::size_t i = 0; i < flags_.size(); ++i)
    if (map_.classes()[i] == kOutside) flags_[i] = kOutside;
  hull_ = HullRows(frame_);
  occupied_rows_ = {hull_.low, hull_.high};
  hull_stale_ = false;
  tiles_.clear();
  tiles_.resize(frame_.tileCount());
  for (int i = 0; i < 3; ++i) group_counts_[i] = (frame_.tiles[i] + 3) / 4;
  groups_.assign(group_counts_.prod(), {});
  seen_sequence_ = 0;
}

const Evaluation& Evaluator::update() {
  if (!(frame_ == map_.frame())) reset();
  const int64_t number = evaluation_.update + 1;
  evaluation_ = Evaluation{};
  evaluation_.update = number;
  Stopwatch watch(evaluation_.timings);
  std::vector<uint8_t> stale(frame_.tileCount(), 0);
  readChanges(stale);
  watch.lap("changes");
  updateHull(stale);
  watch.lap("hull");
  refreshTiles(stale);
  watch.lap("tiles");
  if (!config_.tiled) clusterWhole();
  relink();
  watch.lap("links");
  numberFrontiers();
  watch.lap("frontiers");
  if (config_.tiled) clusterTiled();
  watch.lap("ellipsoids");
  pairFrontierVoids();
  watch.lap("frontier_voids");
  seen_sequence_ = evaluation_.map_sequence = map_.sequence();
  return evaluation_;
}

bool Evaluator::readTile(int tile, TileChange& change) {
  const Voxel corner = tileCorner(tile);
  for (int row = 0; row < kTile * kTile; ++row) {
    const Voxel start = corner + Voxel(0, row % kTile, row / kTile);
    const std::size_t at = frame_.index(start);
    for (int x = 0; x < kTile; ++x) {
      const uint8_t now = map_.classes()[at + x], was = flags_[at + x] & kClassMask;
      if (now == was) continue;
      flags_[at + x] = static_cast<uint8_t>((flags_[at + x] & ~kClassMask) | now);
      if ((now == kOccupied) != (was == kOccupied))
        change.occupied.emplace_back(start + Voxel(x, 0, 0), now == kOccupied);
      const auto side = [](int c) { return c == 0 ? -1 : c == kTile - 1 ? 1 : 0; };
      const int s[3] = {side(x), side(row % kTile), side(row / kTile)};
      for (int m = 0; m < 8; ++m)  // all tiles whose voxels touch this one
        change.touched |= 1u << tileDirection(m & 1 ? s[0] : 0, m & 2 ? s[1] : 0, m & 4 ? s[2] : 0);
    }
  }
  return change.touched != 0;
}

void Evaluator::readChanges(std::vector<uint8_t>& stale) {
  std::vector<int> candidates;
  for (int i = 0; i < frame_.tileCount(); ++i)
    if (map_.tileSequences()[i] > seen_sequence_) candidates.push_back(i);
  std::vector<TileChange> changes(candidates.size());
  parallelChunks(static_cast<int>(candidates.size()), threadCount(config_.threads), 8,
                 [&](int begin, int end, int) {
                   for (int i = begin; i < end; ++i) readTile(candidates[i], changes[i]);
                 });
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    for (int d = 0; d < 27; ++d)
      if (changes[i].touched >> d & 1) {
        const int n = neighbourIndex(candidates[i], d);
        if (n >= 0) stale[n] = 1;
      }
    for (const auto& [voxel, occupied] : changes[i].occupied) hull_stale_ |= noteOccupied(voxel, occupied);
  }
}

/// Keep the row extremes; returns whether the hull may change.
bool Evaluator::noteOccupied(const Voxel& v, bool occupied) {
  const std::size_t row = hull_.row(v.y(), v.z());
  int &low = occupied_rows_.low[row], &high = occupied_rows_.high[row];
  if (occupied) {
    low = std::min(low, v.x());
    high = std::max(high, v.x());
    return !hull_.contains(v);
  }
  if (v.x() != low && v.x() != high) return false;
  const Voxel start(frame_.origin.x(), v.y(), v.z());
  const uint8_t* cells = &flags_[frame_.index(start)];
  low = INT_MAX;
  high = INT_MIN;
  for (int x = 0; x < frame_.dims().x(); ++x)
    if ((cells[x] & kClassMask) == kOccupied) {
      low = std::min(low, start.x() + x);
      high = std::max(high, start.x() + x);
    }
  return hull_.low[row] == v.x() || hull_.high[row] == v.x();
}

void Evaluator::updateHull(std::vector<uint8_t>& stale) {
  if (!hull_stale_) return;
  hull_stale_ = false;
  HullRows next = hullOfRows(frame_, occupied_rows_);
  const auto mark = [&](int from, int to, int y, int z) {  // voxels from <= x < to have changed
    for (int x = std::max(from, frame_.origin.x()); x < std::min(to, frame_.end().x());
         x = floorDiv(x, kTile) * kTile + kTile)
      stale[frame_.tileOf({x, y, z})] = 1;
  };
  for (int z = frame_.origin.z(); z < frame_.end().z(); ++z)
    for (int y = frame_.origin.y(); y < frame_.end().y(); ++y) {
      const std::size_t r = next.row(y, z);
      const bool was = hull_.low[r] <= hull_.high[r], is = next.low[r] <= next.high[r];
      if (was && is) {
        mark(std::min(hull_.low[r], next.low[r]), std::max(hull_.low[r], next.low[r]), y, z);
        mark(std::min(hull_.high[r], next.high[r]) + 1, std::max(hull_.high[r], next.high[r]) + 1, y, z);
      } else if (was || is) {
        const HullRows& rows = was ? hull_ : next;
        mark(rows.low[r], rows.high[r] + 1, y, z);
      }
    }
  hull_ = std::move(next);
}

namespace {

/// The unknown voxels of a tile and of a margin of one around it: rows of 18 bits, bit 0 at x = -1.
void unknownRows(const GridFrame& frame, const std::vector<uint8_t>& flags, const Voxel& corner, bool beyond,
                 std::array<uint32_t, 18 * 18>& rows) {
  const uint32_t outside = beyond ? (1u << 18) - 1 : 0;
  const bool first = corner.x() > frame.origin.x(), last = corner.x() + kTile < frame.end().x();
  for (int z = -1; z <= kTile; ++z)
    for (int y = -1; y <= kTile; ++y) {
      const Voxel start = corner + Voxel(0, y, z);
      uint32_t& row = rows[(y + 1) + 18 * (z + 1)];
      row = outside;
      if (!frame.contains(start)) continue;
      const uint8_t* cells = &flags[frame.index(start)];
      const auto unknown = [&](int x) { return (cells[x] & Evaluator::kClassMask) == kUnknown; };
      row = 0;
      for (int x = 0; x < kTile; ++x) row |= uint32_t{unknown(x)} << (x + 1);
      row |= uint32_t{first ? unknown(-1) : beyond};
      row |= uint32_t{last ? unknown(kTile) : beyond} << 17;
    }
}

uint16_t freeRow(const uint8_t* cells) {
  unsigned row = 0;
  for (int x = 0; x < kTile; ++x) row |= unsigned{(cells[x] & Evaluator::kClassMask) == kFree} << x;
  return static_cast<uint16_t>(row);
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
  unknownRows(frame, flags, corner, beyond, unknown);
  for (std::size_t i = 0; i < unknown.size(); ++i) wide[i] = unknown[i] | unknown[i] << 1 | unknown[i] >> 1;
  for (int z = 0; z < kTile; ++z)
    for (int y = 0; y < kTile; ++y) {
      uint32_t near = 0;
      for (int dz = 0; dz < 3; ++dz)
        for (int dy = 0; dy < 3; ++dy) near |= wide[(y + dy) + 18 * (z + dz)];
      const Voxel start = corner + Voxel(0, y, z);
      frontier[y + kTile * z] = static_cast<uint16_t>(near >> 1) & freeRow(&flags[frame.index(start)]);
      const std::size_t r = hull.row(start.y(), start.z());
      voids[y + kTile * z] = static_cast<uint16_t>(unknown[(y + 1) + 18 * (z + 1)] >> 1) &
                             intervalRow(start.x(), hull.low[r], hull.high[r]);
    }
}

}  // namespace

void Evaluator::refreshTiles(const std::vector<uint8_t>& stale) {
  frontier_changed_.assign(tiles_.size(), 0);
  void_changed_.assign(tiles_.size(), 0);
  const std::vector<int> list = marked(stale);
  const int threads = threadCount(config_.threads);
  // First all masks are read off the flags, then each tile's own flags are written.
  parallelChunks(static_cast<int>(list.size()), threads, 4, [&](int begin, int end, int) {
    TileMask frontier, voids;
    for (int i = begin; i < end; ++i) {
      const int t = list[i];
      tileMasks(frame_, flags_, hull_, tileCorner(t), !map_.bounded(), frontier, voids);
      if (!tiles_[t]) {
        if (maskEmpty(frontier) && maskEmpty(voids)) continue;
        tiles_[t] = std::make_unique<Tile>();
      }
      frontier_changed_[t] = tiles_[t]->frontier != frontier;
      void_changed_[t] = tiles_[t]->voids != voids;
      tiles_[t]->frontier = frontier;
      tiles_[t]->voids = voids;
    }
  });
  parallelChunks(static_cast<int>(list.size()), threads, 1, [&](int begin, int end, int) {
    for (int i = begin; i < end; ++i)
      if (frontier_changed_[list[i]] || void_changed_[list[i]]) relabel(list[i]);
  });
  evaluation_.counts["tiles_stale"] = static_cast<int64_t>(list.size());
}

void Evaluator::relabel(int t) {
  Tile& tile = *tiles_[t];
  writeFlags(t);
  if (frontier_changed_[t]) tile.components = labelComponents(tile.frontier, tile.frontier_labels);
  if (void_changed_[t] && config_.tiled)
    tile.graph = clusterTile(tile.voids, tileCorner(t), rule(), tile.void_labels);
}

void Evaluator::writeFlags(int t) {
  for (int row = 0; row < kTile * kTile; ++row) {
    uint8_t* cells = &flags_[frame_.index(tileCorner(t) + Voxel(0, row % kTile, row / kTile))];
    for (int x = 0; x < kTile; ++x) {
      const int frontier = tiles_[t]->frontier[row] >> x & 1, voids = tiles_[t]->voids[row] >> x & 1;
      cells[x] = static_cast<uint8_t>((cells[x] & kClassMask) | frontier * kFrontierFlag | voids * kVoidFlag);
    }
  }
}

int Evaluator::neighbourIndex(int tile, int direction) const {
  const Voxel n = frame_.tile(tile) + directionStep(direction);
  if ((n.array() < 0).any() || (n.array() >= frame_.tiles.array()).any()) return -1;
  return frame_.tileIndex(n);
}

const Tile* Evaluator::neighbour(int tile, int direction) const {
  const int n = neighbourIndex(tile, direction);
  return n < 0 ? nullptr : tiles_[n].get();
}

/// Tiles that look at one of these tiles: all around them, or those that have them ahead.
std::vector<uint8_t> Evaluator::around(const std::vector<uint8_t>& tiles, bool forward_only) const {
  std::vector<uint8_t> out(tiles.size(), 0);
  for (const int t : marked(tiles))
    for (int d = 0; d < (forward_only ? 14 : 27); ++d) {
      const int n = neighbourIndex(t, d);
      if (n >= 0) out[n] = 1;
    }
  return out;
}

void Evaluator::relink() {
  const std::vector<uint8_t> frontier = around(frontier_changed_, true), voids = around(void_changed_, true);
  std::vector<uint8_t> both = around(void_changed_, false);
  for (std::size_t i = 0; i < both.size(); ++i) both[i] |= frontier_changed_[i];
  std::vector<uint8_t> any(both);
  for (std::size_t i = 0; i < any.size(); ++i) any[i] |= frontier[i] | voids[i];
  const std::vector<int> list = marked(any);
  parallelChunks(static_cast<int>(list.size()), threadCount(config_.threads), 2,
                 [&](int begin, int end, int) {
                   for (int i = begin; i < end; ++i) {
                     const int t = list[i];
                     if (!tiles_[t]) continue;
                     std::array<const TileLabels*, 27> f{}, v{};
                     for (int d = 0; d < 27; ++d) {
                       const Tile* n = neighbour(t, d);
                       if (n && !n->frontier_labels.empty()) f[d] = &n->frontier_labels;
                       if (n && !n->void_labels.empty()) v[d] = &n->void_labels;
                     }
                     Tile& tile = *tiles_[t];
                     if (frontier[t])
                       tile.frontier_links = linksAround(tile.frontier, tile.frontier_labels, f, 14);
                     if (voids[t]) tile.void_links = linksAround(tile.voids, tile.void_labels, v, 14);
                     if (both[t])
                       tile.frontier_voids = linksAround(tile.frontier, tile.frontier_labels, v, 0);
                   }
                 });
}

}  // namespace fv
