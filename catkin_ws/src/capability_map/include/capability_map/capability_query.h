/// How likely can the arm hold a view? Answers from stored spheres in a fraction of a microsecond.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capability_map/direction_lookup.h"
#include "capability_map/sphere_grid.h"

namespace capability_map {

/// The bits of all spheres that have a valid point.
struct SphereBits {
  std::vector<int32_t> row_of_cell;  ///< One per cell of the grid: row of its bits, -1 for an empty sphere.
  std::vector<uint64_t> words;       ///< (rows, words_per_row), bit k of a row is direction k.
  int words_per_row{0};

  bool valid(int32_t row, int direction) const {
    const auto word =
        static_cast<size_t>(row) * static_cast<size_t>(words_per_row) + static_cast<size_t>(direction >> 6);
    return ((words[word] >> (direction & 63)) & 1U) != 0U;
  }
};

/// Queries by tip position and viewing direction (the tip's z; any roll will do). Const and without
/// allocation: one object serves many threads.
///
/// A sphere point's frame lies r away from the sphere's center, so the view (p, d) belongs to the sphere
/// centered at p + r d, not to the cell that contains p.
class CapabilityQuery {
 public:
  /// @param pivot_m Where on the viewing axis, behind the tip, to hold still between stored directions [m]:
  /// views
  ///        that share the point p - pivot d are blended. The wrist's place on that axis is best, because
  ///        what the arm can do hangs on where its wrist must be.
  /// @throws std::invalid_argument when sizes do not fit each other.
  CapabilityQuery(SphereGrid grid, DirectionLookup lookup, const Points& view_directions, SphereBits bits,
                  double pivot_m);

  /// Share of valid points among the 8 cells and 3 directions around the view, weighted linearly; 0..1.
  /// 0 outside the grid and for numbers that are not finite or a direction without length.
  float interpolated(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const;

  /// 1 or 0: the bit of the nearest direction in the sphere that the view belongs to.
  float nearest(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const;

  const SphereGrid& grid() const { return grid_; }
  const SphereBits& bits() const { return bits_; }

 private:
  double cellBlend(const Eigen::Vector3d& center, int direction) const;

  SphereGrid grid_;
  DirectionLookup lookup_;
  std::vector<Eigen::Vector3d> directions_;
  SphereBits bits_;
  double pivot_m_;
};

}  // namespace capability_map
