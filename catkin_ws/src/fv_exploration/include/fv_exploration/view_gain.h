#pragma once
#include <vector>

#include "fv_exploration/evaluator.h"

namespace fv {

/// A camera as rays: x right, y down, z forward; width x height pixels that fill the fields of view.
struct PinholeCamera {
  int width = 320;
  int height = 240;
  double horizontal_fov_rad = 1.0123;
  double vertical_fov_rad = 0.7854;
  double min_range_m = 0.3;  ///< nearer voxels are not seen, but block [m]
  double max_range_m = 3.0;  ///< [m], along the ray
  void validate() const;
  /// Unit directions of every stride-th pixel's centre (N), row by row.
  std::vector<Eigen::Vector3d> rays(int stride) const;
};

/// What views would show anew; one entry per view.
struct ViewGains {
  std::vector<double> void_volume_m3;     ///< void voxels
  std::vector<double> unknown_volume_m3;  ///< unknown voxels within the bounds, void or not
  std::vector<double> frontier_area_m2;   ///< frontier voxels, a face R^2 each
  std::vector<double> occupied_share;     ///< share of the rays that end at an occupied voxel, 0 to 1
};

/// Cast each view's rays through the evaluated map: unknown voxels are seen through, occupied ones end a ray,
/// and each voxel counts once a view. Without bounds unknown space ends where the grid does.
/// @param T_map_cameras (4, 4) each, rigid.
/// @throws InputError naming the view.
ViewGains viewGains(const Evaluator& evaluator, const std::vector<Eigen::Matrix4d>& T_map_cameras,
                    const PinholeCamera& camera, int stride, int threads);

}  // namespace fv
