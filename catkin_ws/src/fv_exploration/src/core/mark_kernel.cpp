#include "mark_kernel.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "fv_exploration/occupancy_tree.h"
#include "grid_lanes.h"

namespace fv {

namespace {

using Doubles = LaneDoubles;
using Integers = LaneIntegers;

/// Eight rays side by side.
struct Lanes {
  double t[3][kLanes], delta[3][kLanes], length[kLanes];
  int64_t at[kLanes], end[kLanes], step[3][kLanes];
};

/// Look before writing: a line of the cache that another thread marks, too, need not be taken from it.
inline void setMiss(uint8_t* mark) {
  if (__atomic_load_n(mark, __ATOMIC_RELAXED) != kMiss) __atomic_store_n(mark, kMiss, __ATOMIC_RELAXED);
}

/// The loop of computeRayKeys for eight rays at once; a ray that is done stays where it is. `steps`: of the
/// longest.
FV_LANE_CLONES void markLanes(const Lanes& lanes, int steps, uint8_t* grid) {
  Doubles t0, t1, t2, length;
  Integers d0, d1, d2, s0, s1, s2, end, at;
  std::memcpy(&t0, lanes.t[0], sizeof(t0));
  std::memcpy(&t1, lanes.t[1], sizeof(t1));
  std::memcpy(&t2, lanes.t[2], sizeof(t2));
  std::memcpy(&d0, lanes.delta[0], sizeof(d0));  // as bits, to be masked
  std::memcpy(&d1, lanes.delta[1], sizeof(d1));
  std::memcpy(&d2, lanes.delta[2], sizeof(d2));
  std::memcpy(&s0, lanes.step[0], sizeof(s0));
  std::memcpy(&s1, lanes.step[1], sizeof(s1));
  std::memcpy(&s2, lanes.step[2], sizeof(s2));
  std::memcpy(&length, lanes.length, sizeof(length));
  std::memcpy(&end, lanes.end, sizeof(end));
  std::memcpy(&at, lanes.at, sizeof(at));
  Integers live = at != end;
  int64_t marks[kLanes];
  for (int i = 0;; ++i) {
    std::memcpy(marks, &at, sizeof(marks));
    for (int lane = 0; lane < kLanes; ++lane) setMiss(grid + marks[lane]);
    const Integers a = t0 < t1, b = t0 < t2, c = t1 < t2;
    const Integers x = a & b, y = ~a & c, z = ~(x | y);
    const Integers next = at + ((s0 & x) | (s1 & y) | (s2 & z));
    t0 += (Doubles)(d0 & x);
    t1 += (Doubles)(d1 & y);
    t2 += (Doubles)(d2 & z);
    const Doubles near = t0 < t1 ? t0 : t1;
    const Doubles nearest = near < t2 ? near : t2;
    live &= (next != end) & ~(nearest > length);
    at = live ? next : at;
    if (i < steps) continue;
    int64_t any[kLanes];
    std::memcpy(any, &live, sizeof(any));
    if (std::all_of(any, any + kLanes, [](int64_t l) { return l == 0; })) return;
  }
}

}  // namespace

void RayBatch::add(const RayMaker::Ray& ray, int64_t at, int64_t end, const int64_t step[3]) {
  const int i = size_++;
  for (int axis = 0; axis < 3; ++axis) {
    t_[axis][i] = ray.t_max[axis];
    delta_[axis][i] = ray.t_delta[axis];
    step_[axis][i] = step[axis];
  }
  length_[i] = ray.length;
  at_[i] = at;
  end_[i] = end;
  count_[i] = (ray.end - ray.at).cwiseAbs().sum();
}

/// Rays of like length share lanes.
void RayBatch::sortByLength() {
  const int longest = *std::max_element(count_, count_ + size_);
  std::vector<int> start(longest + 2, 0);
  for (int i = 0; i < size_; ++i) ++start[count_[i] + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  order_.resize(size_);
  for (int i = 0; i < size_; ++i) order_[start[count_[i]]++] = i;
}

void RayBatch::mark(uint8_t* grid) {
  if (size_ == 0) return;
  sortByLength();
  for (int first = 0; first < size_; first += kLanes) {
    Lanes lanes;
    int steps = 0;
    for (int lane = 0; lane < kLanes; ++lane) {
      const int i = order_[std::min(first + lane, size_ - 1)];  // the last ray fills up
      for (int axis = 0; axis < 3; ++axis) {
        lanes.t[axis][lane] = t_[axis][i];
        lanes.delta[axis][lane] = delta_[axis][i];
        lanes.step[axis][lane] = step_[axis][i];
      }
      lanes.length[lane] = length_[i];
      lanes.at[lane] = at_[i];
      lanes.end[lane] = end_[i];
      steps = std::max(steps, count_[i]);
    }
    markLanes(lanes, steps, grid);
  }
  size_ = 0;
}

}  // namespace fv
