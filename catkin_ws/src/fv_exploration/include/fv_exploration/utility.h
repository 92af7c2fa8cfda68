#pragma once
#include <vector>

#include "fv_exploration/evaluator.h"

namespace fv {

/// Utility of free voxels (thesis 3.1.2, Algorithm 1), ascending by index of the frame.
struct Utility {
  std::vector<Voxel> voxels;
  std::vector<double> utility;  ///< sum of the ellipsoid volumes of the rays through the voxel [m^3]
  std::vector<Eigen::Vector3f> direction;  ///< unit: where to look from there, against the rays
  int64_t rays = 0;
  int64_t visits = 0;  ///< voxels visited by all rays
};

/// Algorithm 1: from each frontier voxel inside the hull, for each void ellipsoid its cluster neighbours, a
/// ray away from each of the ellipsoid's seven corners (centroid and both ends of each axis) through free
/// voxels up to `max_range_m`, blocked by occupied and unknown ones; each voxel on it, the frontier voxel
/// first, gains the ellipsoid's volume.
///
/// Sums are kept in fixed point (2^-34 of the largest volume), so that they do not depend on the threads.
/// @throws InputError unless max_range_m > 0 and finite.
/// @param max_rays 0: all rays, exactly Algorithm 1, whose number grows with frontier times ellipsoids.
/// Otherwise about so
///        many: every k-th (source, ellipsoid) pair, counted k times.
Utility accumulateUtility(const Evaluator& evaluator, double max_range_m, int64_t max_rays, int threads);

/// Non-maximum suppression: indices of at most `count` voxels of highest utility, best first (ties: lower
/// index), no two of them nearer than `suppression_radius_m`.
/// @param allowed by index of `utility`, 0: passed over; empty: all are allowed.
std::vector<int> bestViews(const Utility& utility, double resolution_m, const std::vector<uint8_t>& allowed,
                           int count, double suppression_radius_m);

}  // namespace fv
