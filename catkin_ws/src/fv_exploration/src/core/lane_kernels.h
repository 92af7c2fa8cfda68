#pragma once
#include <vector>

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

/// Rays from voxel centres, number by number, to be set up and walked at once.
struct RayBlock {
  static constexpr int kCapacity = 224;
  int count = 0;
  double away[3][kCapacity];                   ///< where to, of any length but 0
  double weight[kCapacity];                    ///< utility that each voxel gains, fixed point
  int64_t voxel[3][kCapacity], at[kCapacity];  ///< source: coordinates and index in the grid
  double t[3][kCapacity], delta[3][kCapacity];
  int64_t step[3][kCapacity], left[3][kCapacity], adds[4][kCapacity];
};

/// Where the rays of Algorithm 1 go.
struct UtilityGrid {
  const uint8_t* flags;
  int64_t dims[3];
  double range;  ///< [voxels]
};

/// The inner loops, compiled for one instruction set. All round alike.
struct LaneKernels {
  const char* instructions;
  /// The loop of computeRayKeys for eight rays at once; a ray that is done stays where it is. `steps`: of the
  /// longest.
  void (*markLanes)(const MarkLanes& lanes, int steps, uint8_t* grid);
  /// Walk the eight rays of a view to their ends and count what they see anew.
  void (*castLanes)(const LaneRays& rays, const GainGrid& grid, GainCounts& counts);
  /// Walk rays as long as voxels are free and add to these. @return voxels visited.
  int64_t (*addRays)(RayBlock& block, const UtilityGrid& grid, UtilitySums* out);
};

/// Those that this processor can run, the best first.
std::vector<LaneKernels> laneKernels();

/// The best of them.
const LaneKernels& bestKernels();

}  // namespace fv
