#include "hull_tracker.h"

#include <algorithm>
#include <climits>

#include "row_classes.h"

namespace fv {

HullTracker::HullTracker(const GridFrame& frame) : hull_(frame), occupied_{hull_.low, hull_.high} {}

void HullTracker::findEnds(const Voxel& start, unsigned appeared, unsigned vanished,
                           std::vector<End>& ends) const {
  const std::size_t row = hull_.row(start.y(), start.z());
  const int low = occupied_.low[row], high = occupied_.high[row];
  const auto add = [&](int x, bool occupied) { ends.push_back({start + Voxel(x, 0, 0), occupied}); };
  appeared &= ~unsigned{intervalRow(start.x(), low, high)};
  if (appeared) {  // what lies between the ends is of no account
    add(__builtin_ctz(appeared), true);
    if (appeared & (appeared - 1)) add(31 - __builtin_clz(appeared), true);
  }
  if (!vanished) return;  // else the row has ends
  vanished &= unsigned{intervalRow(start.x(), low, low)} | intervalRow(start.x(), high, high);
  for (; vanished; vanished &= vanished - 1) add(__builtin_ctz(vanished), false);
}

void HullTracker::note(const std::vector<End>& ends, const std::vector<uint8_t>& classes) {
  for (const End& end : ends) note(end, classes);
}

void HullTracker::note(const End& end, const std::vector<uint8_t>& classes) {
  const Voxel& v = end.voxel;
  const std::size_t row = hull_.row(v.y(), v.z());
  int &low = occupied_.low[row], &high = occupied_.high[row];
  if (end.occupied) {
    low = std::min(low, v.x());
    high = std::max(high, v.x());
    if (!hull_.contains(v)) grows_.push_back(v);
    return;
  }
  shrinks_ |= std::binary_search(corners_.begin(), corners_.end(), voxelId(v));
  if (v.x() != low && v.x() != high) return;
  const Voxel start(hull_.frame.origin.x(), v.y(), v.z());
  const uint8_t* cells = &classes[hull_.frame.index(start)];
  low = INT_MAX;
  high = INT_MIN;
  for (int x = 0; x < hull_.frame.dims().x(); ++x)
    if ((cells[x] & kClassMask) == kOccupied) {
      low = std::min(low, start.x() + x);
      high = std::max(high, start.x() + x);
    }
}

void HullTracker::update(std::vector<uint8_t>& stale) {
  if (!shrinks_ && grows_.empty()) return;
  if (shrinks_ || hull_.empty()) {
    HullRows before = hullOfRows(hull_.frame, occupied_);
    std::swap(hull_, before);
    for (std::size_t row = 0; row < hull_.low.size(); ++row)
      markRow({row, before.low[row], before.high[row]}, stale);
  } else {
    for (const HullRows::Before& before : hull_.grow(grows_)) markRow(before, stale);
  }
  shrinks_ = false;
  grows_.clear();
  corners_.clear();
  for (const Voxel& corner : hull_.vertices) corners_.push_back(voxelId(corner));
  std::sort(corners_.begin(), corners_.end());
}

/// Mark the tiles of the voxels of a row that the hull has gained or lost.
void HullTracker::markRow(const HullRows::Before& before, std::vector<uint8_t>& stale) const {
  const int low = hull_.low[before.row], high = hull_.high[before.row];
  if (before.low == low && before.high == high) return;
  const GridFrame& frame = hull_.frame;
  const int ny = frame.dims().y(), y = static_cast<int>(before.row % ny),
            z = static_cast<int>(before.row / ny);
  const auto mark = [&](int from, int to) {  // voxels from <= x < to have changed
    from = std::max(from, frame.origin.x());
    to = std::min(to, frame.end().x());
    for (int x = from; x < to; x = floorDiv(x, kTile) * kTile + kTile)
      stale[frame.tileOf({x, y + frame.origin.y(), z + frame.origin.z()})] = 1;
  };
  const bool was = before.low <= before.high, is = low <= high;
  if (was && is) {
    mark(std::min(before.low, low), std::max(before.low, low));
    mark(std::min(before.high, high) + 1, std::max(before.high, high) + 1);
  } else if (was || is) {
    mark(was ? before.low : low, (was ? before.high : high) + 1);
  }
}

}  // namespace fv
