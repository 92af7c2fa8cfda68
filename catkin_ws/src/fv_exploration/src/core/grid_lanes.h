#pragma once
#include "grid_walk.h"

namespace fv {

/// Rays that a kernel is given at once; how many of them it takes in one vector is its own affair.
constexpr int kLanes = 8;

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

}  // namespace fv
