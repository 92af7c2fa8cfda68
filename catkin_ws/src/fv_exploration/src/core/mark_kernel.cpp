#include "mark_kernel.h"

#include <algorithm>
#include <numeric>

#include "fv_exploration/occupancy_tree.h"
#include "lane_kernels.h"

namespace fv {

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
  const LaneKernels& kernels = bestKernels();
  for (int first = 0; first < size_; first += kLanes) {
    MarkLanes lanes;
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
    }
    kernels.markLanes(lanes, kMiss, grid);
  }
  size_ = 0;
}

}  // namespace fv
