#pragma once
#include <array>
#include <string>
#include <vector>

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

constexpr int kFlagBits = 4;  ///< of a voxel's flags; views are numbered in the bits above them
constexpr uint16_t kViewStep = 1 << kFlagBits;

/// What a voxel means to the rays of a view, by its flags.
struct GainTable {
  uint64_t adds[kViewStep];  ///< three counters in one number
  int64_t open[kViewStep];   ///< -1 where rays pass, 0 where they end
  static constexpr uint64_t kOneVoid = 1, kOneUnknown = uint64_t{1} << 21, kOneFrontier = uint64_t{1} << 42;
};

/// Where the rays of a view look things up and remember what they counted.
struct GainGrid {
  const GainTable* table;
  uint16_t* cells;   ///< by voxel: its flags, and above them the view that counted it last
  uint16_t view;     ///< number of the view times kViewStep; above those of all views before it
  double min_range;  ///< [voxels]
};

/// Fixed-point utility, and utility times direction.
using UtilitySums = std::array<int64_t, 4>;

/// Rays from voxel centres, number by number, to be set up and walked at once.
struct RayBlock {
  static constexpr int kCapacity = 224;
  int count = 0;
  double away[3][kCapacity];                   ///< where to, of any length but 0
  double weight[kCapacity];                    ///< utility that each voxel gains, fixed point
  int64_t voxel[3][kCapacity], at[kCapacity];  ///< source: coordinates and index in the grid
  double t[3][kCapacity], delta[3][kCapacity];
  int64_t step[3][kCapacity], left[3][kCapacity];
  UtilitySums adds[kCapacity];
};

/// Where the rays of Algorithm 1 go.
struct UtilityGrid {
  const uint8_t* flags;
  const int64_t* open;  ///< by flags: -1 where rays pass and add, 0 where they end
  int64_t dims[3];
  double range;  ///< [voxels]
};

/// The inner loops for one instruction set. All round alike, and count alike.
struct LaneKernels {
  const char* instruction_set;
  /// The loop of computeRayKeys for eight rays: set the voxels that they pass to `mark`.
  void (*markLanes)(const MarkLanes& lanes, uint8_t mark, uint8_t* grid);
  /// Walk the eight rays of a view to their ends and count what they see anew: fewer than 2^21 of each kind.
  void (*castLanes)(const LaneRays& rays, const GainGrid& grid, GainCounts& counts);
  /// Walk rays as long as voxels are open and add to these. @return voxels visited.
  int64_t (*addRays)(RayBlock& block, const UtilityGrid& grid, UtilitySums* out);
};

/// Ray by ray, one number after the other: what the others are held to.
LaneKernels plainKernels();

/// Those that this processor can run, the best first, the plain ones last.
std::vector<LaneKernels> laneKernels();

/// The best that this processor can run and that are not above `cap`. @param cap "" for no cap.
/// @throws InputError naming the valid ones.
LaneKernels cappedKernels(const std::string& cap);

/// cappedKernels with the cap that the environment variable FV_INSTRUCTION_SET names at the first call.
/// @throws InputError.
const LaneKernels& bestKernels();

}  // namespace fv
