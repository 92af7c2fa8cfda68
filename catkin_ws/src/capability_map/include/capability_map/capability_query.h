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

/// @throws std::invalid_argument unless the bits are those of a grid's cells and of so many directions.
void checkBits(const SphereGrid& grid, Eigen::Index directions, const SphereBits& bits);

/// What about the arm helps between stored directions.
struct ArmPivots {
  double wrist_m{0.0};                      ///< Where the wrist acts on the viewing axis, behind the tip [m].
  Eigen::Vector3d shoulder{0.0, 0.0, 0.0};  ///< About what the arm as a whole turns, base frame [m].
};

/// Queries by tip position and viewing direction (the tip's z; any roll will do). Const and without
/// allocation: one object serves many threads.
///
/// A sphere point's frame lies r away from the sphere's center, so the view (p, d) belongs to the sphere
/// centered at p + r d, not to the cell that contains p.
class CapabilityQuery {
 public:
  /// @param view_directions (N, 3) the tip's z at the sphere points: minus the n-vectors.
  /// @throws std::invalid_argument when sizes do not fit each other, a number is not finite, or all bits
  /// would take more than 512 MiB.
  CapabilityQuery(const SphereGrid& grid, const Points& view_directions, const SphereBits& bits,
                  const ArmPivots& pivots);

  /// Share of valid points around the view, 0..1: weighted linearly over the 8 nearest spheres and, falling
  /// with the angle's cosine, over the stored directions within reachRad().
  ///
  /// A stored direction is not the one asked for. Two motions lead from one to the other, and both have their
  /// say with equal weight: turning the tip about the wrist, for an arm whose wrist bends that much more, and
  /// turning the whole arm about the shoulder.
  /// 0 outside the grid. @throws std::invalid_argument as viewDirection().
  float interpolated(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const;

  /// 1 or 0: the bit of the nearest direction in the sphere that the view belongs to. Errors likewise.
  float nearest(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const;

  /// How far stored directions may lie from the one asked for [rad]: 1.5 times their spacing.
  double reachRad() const { return lookup_.reachRad(); }
  const SphereGrid& grid() const { return grid_; }
  const DirectionLookup& directions() const { return lookup_; }

 private:
  bool bit(const Eigen::Vector3i& cell, int direction) const;
  double cellBlend(const Eigen::Vector3d& center, int direction) const;

  SphereGrid grid_;
  DirectionLookup lookup_;
  ArmPivots pivots_;
  double least_cosine_;
  /// One volume of bits per direction with an empty layer all around: two cells that are neighbours along z
  /// are neighbouring bits, and no place within a cell of the grid needs a check.
  std::vector<uint8_t> volumes_;
  size_t column_bytes_, plane_bytes_, volume_bytes_;
};

}  // namespace capability_map
