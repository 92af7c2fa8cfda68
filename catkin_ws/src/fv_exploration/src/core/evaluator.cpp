#include "fv_exploration/evaluator.h"

#include <algorithm>
#include <chrono>
#include <climits>
#include <cmath>
#include <cstring>

#include "marked_tiles.h"
#include "parallel.h"
#include "row_classes.h"

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
  uint32_t touched = 0;               // bit per direction whose neighbours see a change of what is unknown
  bool any = false, unknown = false;  // whether classes have changed, and whether what is unknown has
  std::vector<std::pair<Voxel, bool>> occupied;  // became occupied, or ceased to be, at an end of a row
};

Evaluator::Evaluator(const OccupancyMap& map, const EvaluationConfig& config) : map_(map), config_(config) {
  config_.validate();
}

ClusterRule Evaluator::rule() const {
  return {{map_.resolution(), config_.literal_formula}, config_.min_fit, config_.seed, config_.seed_share};
}

void Evaluator::reset() {
  frame_ = map_.frame();
  flags_.resize(frame_.size());
  std::transform(map_.classes().begin(), map_.classes().end(), flags_.begin(),
                 [](uint8_t c) { return c == kOutside ? kOutside : kUnknown; });
  hull_ = HullRows(frame_);
  occupied_rows_ = {hull_.low, hull_.high};
  hull_shrinks_ = false;
  hull_grows_.clear();
  hull_corners_.clear();
  const int count = frame_.tileCount();
  tiles_.clear();
  tiles_.resize(count);
  frontier_voxels_ = void_voxels_ = 0;
  for (int d = 0; d < 27; ++d) step_to_[d] = frame_.tileIndex(directionStep(d));
  classes_.assign(count, {});
  for (int t = 0; t < count; ++t) {
    const Voxel corner = tileCorner(t);
    for (int row = 0; row < kTile * kTile; ++row)
      classes_[t].unknown[row] = static_cast<uint16_t>(
          RowClasses(&flags_[frame_.index(corner + Voxel(0, row % kTile, row / kTile))]).unknown);
  }
  components_.assign(count, 0);
  labels_.assign(count, 0);
  first_component_.assign(count, 0);
  first_label_.assign(count, 0);
  const Voxel groups = (frame_.tiles + Voxel::Constant(3)) / 4;
  groups_.assign(groups.prod(), {});
  group_of_.resize(count);
  for (int t = 0; t < count; ++t) {
    const Voxel g = frame_.tile(t) / 4;
    group_of_[t] = (g.z() * groups.y() + g.y()) * groups.x() + g.x();
    groups_[group_of_[t]].tiles.push_back(t);
  }
  joined_.clear();
  seen_sequence_ = 0;
}

const Evaluation& Evaluator::update() {
  if (!(frame_ == map_.frame())) reset();
  const int64_t number = evaluation_->update + 1;
  nextEvaluation();
  evaluation_->update = number;
  Stopwatch watch(evaluation_->timings);
  std::vector<uint8_t> stale_frontiers(frame_.tileCount(), 0), stale_voids(frame_.tileCount(), 0);
  readChanges(stale_frontiers, stale_voids);
  watch.lap("changes");
  refreshFrontiers(stale_frontiers, stale_voids);
  watch.lap("hull_and_frontiers");
  refreshVoids(stale_voids);
  watch.lap("voids");
  if (!config_.tiled) clusterWhole();
  std::vector<uint8_t> stale_groups(groups_.size(), 0);
  relinkTiles(stale_groups);
  watch.lap("links");
  refreshGroups(stale_groups);
  watch.lap("groups");
  numberFrontiers();
  if (config_.tiled) joinAcross();
  rankEllipsoids();
  watch.lap("clusters");
  pairFrontierVoids();
  watch.lap("frontier_voids");
  seen_sequence_ = evaluation_->map_sequence = map_.sequence();
  return *evaluation_;
}

/// A new result, with the memory of the one before the last when nobody looks at it any more.
void Evaluator::nextEvaluation() {
  std::swap(evaluation_, spare_);
  if (evaluation_ && evaluation_.use_count() == 1)
    evaluation_->clear();
  else
    evaluation_ = std::make_shared<Evaluation>();
}

void Evaluator::readTile(int tile, bool all_rows, TileChange& change) {
  const Voxel corner = tileCorner(tile);
  const OccupancyMap::RowSet& rows = map_.changedRows(tile);
  TileClasses& known = classes_[tile];
  for (int row = 0; row < kTile * kTile; ++row) {
    if (!all_rows && !rows[row]) continue;
    const Voxel start = corner + Voxel(0, row % kTile, row / kTile);
    const std::size_t at = frame_.index(start);
    const RowClasses now(&map_.classes()[at]);
    const unsigned unknown = known.unknown[row], free = known.free[row];
    const unsigned differ = (unknown ^ now.unknown) | (free ^ now.free);
    if (!differ) continue;
    now.write(&flags_[at]);
    known.unknown[row] = static_cast<uint16_t>(now.unknown);
    known.free[row] = static_cast<uint16_t>(now.free);
    noteRow(start, differ & now.occupied, differ & ~(unknown | free), change);
    change.any = true;
    const unsigned seen = unknown ^ now.unknown;
    if (!seen) continue;
    change.unknown = true;
    const int y = row % kTile, z = row / kTile;
    change.touched |= touchedDirections(1, y, z);
    if (seen & 1) change.touched |= touchedDirections(0, y, z);
    if (seen >> (kTile - 1)) change.touched |= touchedDirections(kTile - 1, y, z);
  }
}

/// Note what may move an end of a row of occupied voxels, and so the hull.
/// @param start first voxel of the row in a tile. @param appeared, vanished occupied voxels, as bits.
void Evaluator::noteRow(const Voxel& start, unsigned appeared, unsigned vanished, TileChange& change) const {
  const std::size_t row = hull_.row(start.y(), start.z());
  const int low = occupied_rows_.low[row], high = occupied_rows_.high[row];
  const auto note = [&](int x, bool occupied) {
    change.occupied.emplace_back(start + Voxel(x, 0, 0), occupied);
  };
  appeared &= ~unsigned{intervalRow(start.x(), low, high)};
  if (appeared) {  // what lies between the ends is of no account
    note(__builtin_ctz(appeared), true);
    if (appeared & (appeared - 1)) note(31 - __builtin_clz(appeared), true);
  }
  if (!vanished) return;  // else the row has ends
  vanished &= unsigned{intervalRow(start.x(), low, low)} | intervalRow(start.x(), high, high);
  for (; vanished; vanished &= vanished - 1) note(__builtin_ctz(vanished), false);
}

/// Take over what has changed in the map.
/// @param[out] frontiers, voids tiles in which they are to be updated.
void Evaluator::readChanges(std::vector<uint8_t>& frontiers, std::vector<uint8_t>& voids) {
  std::vector<int> candidates;
  for (int i = 0; i < frame_.tileCount(); ++i)
    if (map_.tileSequences()[i] > seen_sequence_) candidates.push_back(i);
  const bool all_rows = seen_sequence_ + 1 != map_.sequence();  // else the map knows which
  std::vector<TileChange> changes(candidates.size());
  parallelChunks(static_cast<int>(candidates.size()), threadCount(config_.threads), 8,
                 [&](int begin, int end, int) {
                   for (int i = begin; i < end; ++i) readTile(candidates[i], all_rows, changes[i]);
                 });
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (changes[i].any) frontiers[candidates[i]] = 1;
    if (changes[i].unknown) {
      voids[candidates[i]] = 1;
      const std::array<int, 27> around = neighbours(candidates[i]);
      for (int d = 0; d < 27; ++d)
        if (changes[i].touched >> d & 1 && around[d] >= 0) frontiers[around[d]] = 1;
    }
    for (const auto& [voxel, occupied] : changes[i].occupied) noteOccupied(voxel, occupied);
  }
}

/// Keep the row extremes, and note what becomes of the hull.
void Evaluator::noteOccupied(const Voxel& v, bool occupied) {
  const std::size_t row = hull_.row(v.y(), v.z());
  int &low = occupied_rows_.low[row], &high = occupied_rows_.high[row];
  if (occupied) {
    low = std::min(low, v.x());
    high = std::max(high, v.x());
    if (!hull_.contains(v)) hull_grows_.push_back(v);
    return;
  }
  hull_shrinks_ |= std::binary_search(hull_corners_.begin(), hull_corners_.end(), voxelId(v));
  if (v.x() != low && v.x() != high) return;
  const Voxel start(frame_.origin.x(), v.y(), v.z());
  const uint8_t* cells = &flags_[frame_.index(start)];
  low = INT_MAX;
  high = INT_MIN;
  for (int x = 0; x < frame_.dims().x(); ++x)
    if ((cells[x] & kClassMask) == kOccupied) {
      low = std::min(low, start.x() + x);
      high = std::max(high, start.x() + x);
    }
}

/// Tiles of voxels that the hull gains or loses become stale.
void Evaluator::updateHull(std::vector<uint8_t>& stale) {
  if (!hull_shrinks_ && hull_grows_.empty()) return;
  if (hull_shrinks_ || hull_.empty()) {
    HullRows before = hullOfRows(frame_, occupied_rows_);
    std::swap(hull_, before);
    for (std::size_t row = 0; row < hull_.low.size(); ++row)
      markRow({row, before.low[row], before.high[row]}, stale);
  } else {
    for (const HullRows::Before& before : hull_.grow(hull_grows_)) markRow(before, stale);
  }
  hull_shrinks_ = false;
  hull_grows_.clear();
  hull_corners_.clear();
  for (const Voxel& corner : hull_.vertices) hull_corners_.push_back(voxelId(corner));
  std::sort(hull_corners_.begin(), hull_corners_.end());
}

/// Mark the tiles of the voxels of a row that the hull has gained or lost.
void Evaluator::markRow(const HullRows::Before& before, std::vector<uint8_t>& stale) const {
  const int low = hull_.low[before.row], high = hull_.high[before.row];
  if (before.low == low && before.high == high) return;
  const int ny = frame_.dims().y(), y = static_cast<int>(before.row % ny),
            z = static_cast<int>(before.row / ny);
  const auto mark = [&](int from, int to) {  // voxels from <= x < to have changed
    from = std::max(from, frame_.origin.x());
    to = std::min(to, frame_.end().x());
    for (int x = from; x < to; x = floorDiv(x, kTile) * kTile + kTile)
      stale[frame_.tileOf({x, y + frame_.origin.y(), z + frame_.origin.z()})] = 1;
  };
  const bool was = before.low <= before.high, is = low <= high;
  if (was && is) {
    mark(std::min(before.low, low), std::max(before.low, low));
    mark(std::min(before.high, high) + 1, std::max(before.high, high) + 1);
  } else if (was || is) {
    mark(was ? before.low : low, (was ? before.high : high) + 1);
  }
}

/// The tiles in all directions; -1 beyond the frame.
std::array<int, 27> Evaluator::neighbours(int t) const {
  std::array<int, 27> out;
  const Voxel at = frame_.tile(t);
  const auto inside = [](int c, int count) { return c >= 0 && c < count; };
  for (int d = 0; d < 27; ++d) {
    const Voxel n = at + directionStep(d);
    const bool within =
        inside(n.x(), frame_.tiles.x()) && inside(n.y(), frame_.tiles.y()) && inside(n.z(), frame_.tiles.z());
    out[d] = within ? t + step_to_[d] : -1;
  }
  return out;
}

}  // namespace fv
