#pragma once
#include "fv_exploration/grid.h"

namespace fv {

/// Filters before integration, each switched off by its default; applied in this order.
struct FilterConfig {
  double min_range_m = 0.0;   ///< nearer points are removed [m]
  double max_range_m = 0.0;   ///< farther points are removed [m]; 0: none
  double voxel_leaf_m = 0.0;  ///< one point, the centroid, per cube of this edge [m]; 0: off (pcl::VoxelGrid)
  int outlier_neighbours =
      0;  ///< mean distance to so many neighbours is judged; 0: off (StatisticalOutlierRemoval)
  double outlier_deviations = 1.0;  ///< removed beyond so many standard deviations from the mean of all
  double isolated_radius_m =
      0.0;                      ///< radius in which neighbours are counted [m]; 0: off (RadiusOutlierRemoval)
  int isolated_neighbours = 5;  ///< fewer neighbours than this: removed
  /// @throws InputError.
  void validate() const;
};

/// Points (M, 3) that pass; rows that are not finite, or at ranges that no sensor sees, are gone. Sensor
/// frame in, sensor frame out. One stray return inflates the convex hull, and with it the voids: that is what
/// these are for.
PointsF filterCloud(const Eigen::Ref<const PointsF>& points_sensor, const FilterConfig& config);

}  // namespace fv
