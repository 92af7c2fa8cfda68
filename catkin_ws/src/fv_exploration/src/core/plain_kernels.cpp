// The kernels of lane_kernels.h as one would write them first. Tests hold the others to these, and
// scripts/bench lanes says how much faster those are.
#include <cmath>

#include "lane_kernels.h"

namespace fv {

namespace {

double leastOf(const double t[3]) { return std::min(std::min(t[0], t[1]), t[2]); }

/// Along which a ray leaves its voxel first; of equal ones the last.
int nextAxis(const double t[3]) { return t[0] < t[1] ? (t[0] < t[2] ? 0 : 2) : (t[1] < t[2] ? 1 : 2); }

void markLanes(const MarkLanes& lanes, uint8_t mark, uint8_t* grid) {
  for (int lane = 0; lane < kLanes; ++lane) {
    double t[3] = {lanes.t[0][lane], lanes.t[1][lane], lanes.t[2][lane]};
    int64_t at = lanes.at[lane];
    grid[at] = mark;
    while (at != lanes.end[lane]) {
      const int axis = nextAxis(t);
      at += lanes.step[axis][lane];
      t[axis] += lanes.delta[axis][lane];
      if (at == lanes.end[lane] || leastOf(t) > lanes.length[lane]) break;
      grid[at] = mark;
    }
  }
}

/// @return false where the length or the grid ends; the ray stays then.
bool advance(GridWalk& walk, double end) {
  if (leastOf(walk.t) > end) return false;
  const int axis = nextAxis(walk.t);
  if (walk.left[axis]-- == 0) return false;
  walk.at += walk.step[axis];
  walk.t[axis] += walk.delta[axis];
  return true;
}

void castLanes(const LaneRays& rays, const GainGrid& grid, GainCounts& counts) {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (!rays.live[lane]) continue;
    GridWalk walk;
    for (int axis = 0; axis < 3; ++axis) {
      walk.t[axis] = rays.t[axis][lane];
      walk.delta[axis] = rays.delta[axis][lane];
      walk.step[axis] = rays.step[axis][lane];
      walk.left[axis] = rays.left[axis][lane];
    }
    walk.at = rays.at[lane];
    do {
      uint16_t& cell = grid.cells[walk.at];
      const int flags = cell % kViewStep;
      if (leastOf(walk.t) >= grid.min_range && cell < grid.view) {
        cell = static_cast<uint16_t>(grid.view | flags);
        counts.voids += (grid.table->adds[flags] & GainTable::kOneVoid) != 0;
        counts.unknown += (grid.table->adds[flags] & GainTable::kOneUnknown) != 0;
        counts.frontier += (grid.table->adds[flags] & GainTable::kOneFrontier) != 0;
      }
      if (!grid.table->open[flags]) {
        ++counts.occupied;
        break;
      }
    } while (advance(walk, rays.end[lane]));
  }
}

/// The start of a ray of a block, and what it adds.
GridWalk start(const RayBlock& block, int ray, const UtilityGrid& grid, UtilitySums& adds) {
  const double x = block.away[0][ray], y = block.away[1][ray], z = block.away[2][ray];
  const double length = std::sqrt(x * x + y * y + z * z);
  GridWalk walk;
  int64_t stride = 1;
  adds[0] = nearestInt(block.weight[ray]);
  for (int axis = 0; axis < 3; ++axis) {
    const double direction = block.away[axis][ray] / length;
    const bool up = direction > 0;
    walk.delta[axis] = std::min(1.0 / std::fabs(direction), GridWalk::kNever);
    walk.t[axis] = 0.5 * walk.delta[axis];
    walk.step[axis] = up ? stride : -stride;
    walk.left[axis] = up ? grid.dims[axis] - 1 - block.voxel[axis][ray] : block.voxel[axis][ray];
    adds[axis + 1] = nearestInt(block.weight[ray] * direction);
    stride *= grid.dims[axis];
  }
  walk.at = block.at[ray];
  return walk;
}

int64_t addRays(RayBlock& block, const UtilityGrid& grid, UtilitySums* out) {
  int64_t visits = 0;
  for (int ray = 0; ray < block.count; ++ray) {
    UtilitySums adds;
    GridWalk walk = start(block, ray, grid, adds);
    do {
      if (!grid.open[grid.flags[walk.at]]) break;
      for (int i = 0; i < 4; ++i) out[walk.at][i] += adds[i];
      ++visits;
    } while (advance(walk, grid.range));
  }
  return visits;
}

}  // namespace

LaneKernels plainKernels() { return {"plain", markLanes, castLanes, addRays}; }

}  // namespace fv
