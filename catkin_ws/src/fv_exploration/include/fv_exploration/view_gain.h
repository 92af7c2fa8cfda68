#pragma once
#include <string>
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
  /// Number of the ray, of those of stride 1, in whose pixel a point of the optical frame lies; -1: in none.
  int rayThrough(const Eigen::Vector3d& p) const;
};

/// @throws InputError naming the transform unless it is finite and rigid.
void requireRigid(const Eigen::Matrix4d& T, const std::string& name);

/// What errors call a view.
std::string viewName(std::size_t view);

/// What to expect of rays, views x rays, row by row; empty vectors say nothing.
struct RayOutlook {
  /// That the ray comes back, 0 to 1: what it shows counts so much. A voxel that several rays meet counts
  /// with the highest, to within the mean of eight rays of like chance.
  std::vector<float> chance;
  /// Where the ray is cast to [m].
  std::vector<float> reach_m;
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
/// @param outlook what to expect of the rays; empty: each comes back, from wherever it is sent back.
/// @throws InputError naming the view.
ViewGains viewGains(const Evaluator& evaluator, const std::vector<Eigen::Matrix4d>& T_map_cameras,
                    const PinholeCamera& camera, int stride, int threads, const RayOutlook& outlook = {});

}  // namespace fv
