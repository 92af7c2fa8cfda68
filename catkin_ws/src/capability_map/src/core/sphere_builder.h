/// Reachability spheres by inverse kinematics (thesis 3.2, step 1).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capability_map/sphere_grid.h"
#include "view_probe.h"

namespace capability_map {

/// Spheres of some cells. Only valid points have a witness: point by point in the order of the cells, then of
/// the directions.
struct SphereBatch {
  Eigen::Matrix<uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> valid;  ///< (C, N), 0 or 1.
  std::vector<float> witnesses;       ///< (V, dof) joint values that hold the point.
  std::vector<float> manipulability;  ///< (V) Yoshikawa's measure of the witness.
  int64_t points_skipped{0};          ///< Beyond the arm's proven reach, no IK asked.
  ProbeCounts counts;
};

/// Decides every point of the spheres of the given cells.
/// A sphere point stands at center + r n with its frame's z towards the center: z = -n (thesis 3.2).
/// Points farther from the reach bound's center than its radius are skipped: no configuration gets there.
/// @param outward (N, 3) n-vectors of the sphere points. @param cells Cell numbers of the grid.
/// @throws std::out_of_range for a cell that the grid does not have.
SphereBatch buildSpheres(ViewProbe& probe, const SphereGrid& grid, const Points& outward,
                         const std::vector<int64_t>& cells);

/// Cells of the grid with at least one sphere point within the proven reach.
std::vector<int64_t> cellsInReach(const SphereGrid& grid, const fv_robot_model::ik::ReachBound& bound);

}  // namespace capability_map
