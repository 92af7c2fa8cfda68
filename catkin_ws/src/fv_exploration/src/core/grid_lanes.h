#pragma once
#include <cstring>

#include "grid_walk.h"

namespace fv {

constexpr int kLanes = 8;
typedef double LaneDoubles __attribute__((vector_size(8 * kLanes)));
typedef int64_t LaneIntegers __attribute__((vector_size(8 * kLanes)));

/// Functions of rays side by side are compiled for several instruction sets and chosen when the library is
/// loaded; all give the same results.
#define FV_LANE_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#define FV_LANE_INLINE inline __attribute__((always_inline))

/// Eight GridWalks as rows of numbers, to be filled ray by ray.
struct LaneRays {
  double t[3][kLanes], delta[3][kLanes], end[kLanes];
  int64_t step[3][kLanes], left[3][kLanes], at[kLanes], live[kLanes];

  /// @param end length of the ray [voxels].
  void set(int lane, const GridWalk& walk, double end_length) {
    for (int axis = 0; axis < 3; ++axis) {
      t[axis][lane] = walk.t[axis];
      delta[axis][lane] = walk.delta[axis];
      step[axis][lane] = walk.step[axis];
      left[axis][lane] = walk.left[axis];
    }
    at[lane] = walk.at;
    end[lane] = end_length;
    live[lane] = -1;
  }
  /// A lane without a ray: it stays at voxel 0 and is not live.
  void clear(int lane) {
    GridWalk none;
    for (int axis = 0; axis < 3; ++axis) none.begin(axis, 0.0, 0.0, 0.0, 1, 0);
    set(lane, none, 0.0);
    live[lane] = 0;
  }
};

/// The same in registers.
struct LaneWalk {
  LaneDoubles t[3], end;
  LaneIntegers delta[3], step[3], left[3], at, live;  // delta: the bits of doubles, to be masked

  FV_LANE_INLINE void load(const LaneRays& rays) {
    std::memcpy(t, rays.t, sizeof(t));
    std::memcpy(delta, rays.delta, sizeof(delta));
    std::memcpy(step, rays.step, sizeof(step));
    std::memcpy(left, rays.left, sizeof(left));
    std::memcpy(&end, rays.end, sizeof(end));
    std::memcpy(&at, rays.at, sizeof(at));
    std::memcpy(&live, rays.live, sizeof(live));
  }

  /// Lengths at which the rays leave their voxels.
  FV_LANE_INLINE void leaves(LaneDoubles& out) const {
    const LaneDoubles near = t[0] < t[1] ? t[0] : t[1];
    out = near < t[2] ? near : t[2];
  }

  /// Every live ray to its next voxel, unless its length or the grid ends there: then it is no longer live.
  FV_LANE_INLINE void advance() {
    LaneDoubles leave;
    leaves(leave);
    const LaneIntegers a = t[0] < t[1], b = t[0] < t[2], c = t[1] < t[2];
    const LaneIntegers x = a & b, y = ~a & c, z = ~(x | y);
    const LaneIntegers next = at + ((step[0] & x) | (step[1] & y) | (step[2] & z));
    t[0] += (LaneDoubles)(delta[0] & x);
    t[1] += (LaneDoubles)(delta[1] & y);
    t[2] += (LaneDoubles)(delta[2] & z);
    left[0] += x;
    left[1] += y;
    left[2] += z;
    live &= ~(leave > end) & ((left[0] | left[1] | left[2]) >= 0);
    at = live ? next : at;
  }

  FV_LANE_INLINE bool anyLive() const {
    int64_t lanes[kLanes], any = 0;
    std::memcpy(lanes, &live, sizeof(lanes));
    for (int i = 0; i < kLanes; ++i) any |= lanes[i];
    return any != 0;
  }
};

}  // namespace fv
