/// Which stored point is nearest to a view? Its witness is where a planner may start.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capability_map/capability_query.h"
#include "capability_map/sphere_grid.h"

namespace capability_map {

/// Const and without allocation after construction: one object serves many threads.
class SeedLookup {
 public:
  struct Seed {
    int64_t point{-1};  ///< Number of the valid point, sphere by sphere, direction by direction; -1: none.
    double angle_rad{0.0};  ///< Between the view's direction and that of the point.
  };

  /// @param view_directions (N, 3) the tip's z at the sphere points.
  /// @throws std::invalid_argument when sizes do not fit each other.
  SeedLookup(const SphereGrid& grid, const Points& view_directions, SphereBits bits);

  /// The valid point of least angle in the sphere that the view belongs to (around p + r d). None outside the
  /// grid and in an empty sphere. @throws std::invalid_argument as viewDirection().
  Seed nearest(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const;

 private:
  SphereGrid grid_;
  std::vector<Eigen::Vector3d> directions_;
  SphereBits bits_;
  std::vector<int64_t> first_point_;  // of each row
};

}  // namespace capability_map
