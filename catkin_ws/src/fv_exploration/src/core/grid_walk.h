#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "fv_exploration/grid.h"

namespace fv {

/// Floor of a number that fits into an int, without a call.
inline int floorInt(double x) {
  const int towards_zero = static_cast<int>(x);
  return towards_zero - (x < towards_zero);
}

/// Nearest integer of a number that fits, halves away from 0, without a call.
inline int64_t nearestInt(double x) { return static_cast<int64_t>(x + (x < 0 ? -0.5 : 0.5)); }

/// Cut the part [begin, end] of a ray to what lies within a grid; all in voxels, the grid begins at 0.
/// @return false when nothing is left.
inline bool clipToGrid(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, const Voxel& dims,
                       double& begin, double& end) {
  for (int i = 0; i < 3; ++i) {
    if (direction[i] == 0) {
      if (origin[i] < 0 || origin[i] >= dims[i]) return false;
      continue;
    }
    const double a = -origin[i] / direction[i], b = (dims[i] - origin[i]) / direction[i];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin < end;
}

/// The start of a ray that goes from voxel to voxel of a linear grid (Amanatides and Woo 1987); lengths in
/// voxels.
struct GridWalk {
  int64_t at = 0;  ///< index of the voxel

  /// Set up one axis: the voxel that the ray is in at length `from`.
  /// @param origin, direction of the ray along the axis; the grid begins at 0 and has `size` voxels.
  void begin(int axis, double origin, double direction, double from, int size, int64_t stride) {
    const int voxel = std::clamp(floorInt(origin + from * direction), 0, size - 1);
    at += voxel * stride;
    const bool up = direction > 0;
    step[axis] = up ? stride : -stride;
    left[axis] = up ? size - 1 - voxel : voxel;
    const double border = up ? voxel + 1 : voxel;
    const bool still = direction == 0;
    delta[axis] = still ? kNever : 1.0 / std::fabs(direction);
    t[axis] = still ? kNever : (border - origin) / direction;
  }

  static constexpr double kNever = 1e30;  // of an axis that the ray does not move along

  int64_t step[3];
  int64_t left[3];  ///< voxels before the end of the grid
  double t[3];      ///< length at the next border
  double delta[3];  ///< length from border to border
};

}  // namespace fv
