#pragma once
#include "fv_exploration/evaluator.h"
#include "grid_lanes.h"

namespace fv {

/// Eight rays of a scan.
struct MarkLanes {
  double t[3][kLanes], delta[3][kLanes], length[kLanes];
  int64_t at[kLanes], end[kLanes], step[3][kLanes];
};

/// Voxels and rays of a view.
struct GainCounts {
  int64_t voids = 0, unknown = 0, frontier = 0, occupied = 0;
};

/// Where the rays of a view look things up and remember what they counted.
struct GainGrid {
  const uint8_t* flags;
  uint16_t* counted;  // number of the view that counted a voxel last
  uint16_t view;
  double min_range;  // [voxels]
};

/// Fixed-point utility, and utility times direction; added as one vector.
typedef int64_t UtilitySums __attribute__((vector_size(32)));

/// The loop of computeRayKeys for eight rays at once; a ray that is done stays where it is. `steps`: of the
/// longest.
void markLanes(const MarkLanes& lanes, int steps, uint8_t* grid);

/// Walk the eight rays of a view to their ends and count what they see anew.
void castLanes(const LaneRays& rays, const GainGrid& grid, GainCounts& counts);

/// Add `adds` to the voxels of eight rays as long as these are free. @return voxels visited.
int64_t addLanes(const LaneRays& rays, const uint8_t* flags, const UtilitySums adds[kLanes],
                 UtilitySums* out);

}  // namespace fv
