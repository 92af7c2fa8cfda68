// A hull that went along with changes against that of all that is occupied.
#include <gtest/gtest.h>

#include <climits>
#include <random>

#include "hull_tracker.h"

namespace {

using fv::Voxel;

const fv::GridFrame kFrame{{-16, 0, 16}, {2, 2, 2}};

/// By index of the frame.
std::vector<uint8_t> inside(const fv::HullRows& hull) {
  std::vector<uint8_t> out(kFrame.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = hull.contains(kFrame.voxel(i));
  return out;
}

fv::HullRows hullOf(const std::vector<uint8_t>& classes) {
  const fv::HullRows empty(kFrame);
  fv::RowExtremes rows{empty.low, empty.high};
  for (std::size_t i = 0; i < classes.size(); ++i) {
    if (classes[i] != fv::kOccupied) continue;
    const Voxel v = kFrame.voxel(i);
    int &low = rows.low[empty.row(v.y(), v.z())], &high = rows.high[empty.row(v.y(), v.z())];
    low = std::min(low, v.x());
    high = std::max(high, v.x());
  }
  return fv::hullOfRows(kFrame, rows);
}

/// Tell a tracker of all rows in which what is occupied has changed.
void tell(fv::HullTracker& tracker, const std::vector<uint8_t>& before, const std::vector<uint8_t>& now) {
  std::vector<fv::HullTracker::End> ends;
  for (std::size_t i = 0; i < now.size(); i += fv::kTile) {
    unsigned appeared = 0, vanished = 0;
    for (int x = 0; x < fv::kTile; ++x) {
      const bool was = before[i + x] == fv::kOccupied, is = now[i + x] == fv::kOccupied;
      appeared |= unsigned{is && !was} << x;
      vanished |= unsigned{was && !is} << x;
    }
    tracker.findEnds(kFrame.voxel(i), appeared, vanished, ends);
  }
  tracker.note(ends, now);
}

/// Some voxels appear anywhere, some of the occupied ones vanish.
void change(std::vector<uint8_t>& classes, std::mt19937& rng) {
  for (int n = static_cast<int>(rng() % 6); n > 0; --n) classes[rng() % classes.size()] = fv::kOccupied;
  const unsigned share = rng() % 3 ? 0 : 4;
  for (uint8_t& c : classes)
    if (share && c == fv::kOccupied && rng() % share == 0) c = fv::kFree;
}

TEST(HullTracker, IsTheHullOfWhatIsOccupiedNow) {
  std::mt19937 rng(5);
  fv::HullTracker tracker(kFrame);
  std::vector<uint8_t> classes(kFrame.size(), fv::kFree), was_inside = inside(tracker.hull());
  int grown = 0, shrunk = 0;
  for (int step = 0; step < 80; ++step) {
    const std::vector<uint8_t> before = classes;
    change(classes, rng);
    tell(tracker, before, classes);
    std::vector<uint8_t> stale(kFrame.tileCount(), 0), differ(kFrame.tileCount(), 0);
    tracker.update(stale);
    const std::vector<uint8_t> is_inside = inside(tracker.hull());
    ASSERT_EQ(is_inside, inside(hullOf(classes))) << "step " << step;
    for (std::size_t i = 0; i < is_inside.size(); ++i) {
      if (is_inside[i] == was_inside[i]) continue;
      differ[kFrame.tileOf(kFrame.voxel(i))] = 1;
      ++(is_inside[i] ? grown : shrunk);
    }
    ASSERT_EQ(stale, differ) << "step " << step;
    was_inside = is_inside;
  }
  EXPECT_GT(grown, 1000);
  EXPECT_GT(shrunk, 1000);
}

}  // namespace
