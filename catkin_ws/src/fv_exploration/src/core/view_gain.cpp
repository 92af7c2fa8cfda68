#include "fv_exploration/view_gain.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fv_exploration/parallel.h"
#include "lane_kernels.h"

namespace fv {

namespace {

/// Casts the rays of one view at a time; remembers which voxels the view has counted.
class GainCaster {
 public:
  GainCaster(const Evaluator& evaluator, const PinholeCamera& camera)
      : frame_(evaluator.frame()),
        flags_(evaluator.flags().data()),
        factor_(1.0 / evaluator.map().resolution()),
        min_range_(camera.min_range_m * factor_),
        max_range_(camera.max_range_m * factor_),
        counted_(evaluator.frame().size(), 0) {
    stride_[0] = 1;
    stride_[1] = frame_.dims().x();
    stride_[2] = stride_[1] * frame_.dims().y();
  }

  GainCounts cast(const Eigen::Matrix4d& T_map_camera, const std::vector<Eigen::Vector3d>& rays) {
    if (++view_ == 0) {  // numbers are used up
      std::fill(counted_.begin(), counted_.end(), 0);
      view_ = 1;
    }
    GainCounts counts;
    const Eigen::Vector3d origin =
        T_map_camera.topRightCorner<3, 1>() * factor_ - frame_.origin.cast<double>();
    const Eigen::Matrix3d R = T_map_camera.topLeftCorner<3, 3>();
    const GainGrid grid{flags_, counted_.data(), view_, min_range_};
    LaneRays lanes;
    int filled = 0;
    for (const Eigen::Vector3d& ray : rays) {
      filled += prepare(origin, R * ray, lanes, filled);
      if (filled == kLanes) {
        bestKernels().castLanes(lanes, grid, counts);
        filled = 0;
      }
    }
    if (filled == 0) return counts;
    while (filled < kLanes) lanes.clear(filled++);
    bestKernels().castLanes(lanes, grid, counts);
    return counts;
  }

 private:
  /// Part of the ray inside the frame, [begin, end] in voxels; false without any.
  bool clip(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double& begin,
            double& end) const {
    begin = 0;
    end = max_range_;
    const Voxel dims = frame_.dims();
    for (int i = 0; i < 3; ++i) {
      if (direction[i] == 0) {
        if (origin[i] < 0 || origin[i] >= dims[i]) return false;
        continue;
      }
      const double a = -origin[i] / direction[i], b = (dims[i] - origin[i]) / direction[i];
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    return begin < end;
  }

  /// Put a ray into a lane; false when it misses the grid.
  bool prepare(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, LaneRays& lanes,
               int lane) const {
    double begin, end;
    if (!clip(origin, direction, begin, end)) return false;
    GridWalk walk;
    for (int i = 0; i < 3; ++i) walk.begin(i, origin[i], direction[i], begin, frame_.dims()[i], stride_[i]);
    lanes.set(lane, walk, end);
    return true;
  }

  const GridFrame& frame_;
  const uint8_t* flags_;
  double factor_, min_range_, max_range_;  // ranges in voxels
  int64_t stride_[3];
  std::vector<uint16_t> counted_;
  uint16_t view_ = 0;
};

void requirePose(const Eigen::Matrix4d& T, std::size_t view) {
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if (T.allFinite() && (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-4 && R.determinant() > 0)
    return;
  std::ostringstream text;
  text << "T_map_cameras[" << view << "] is not a finite rigid transform; valid: rotation and translation";
  throw InputError(text.str());
}

}  // namespace

void PinholeCamera::validate() const {
  require(width > 0 && width <= 100000, "width", width, "1 to 100000");
  require(height > 0 && height <= 100000, "height", height, "1 to 100000");
  require(horizontal_fov_rad > 0 && horizontal_fov_rad < M_PI, "horizontal_fov_rad", horizontal_fov_rad,
          "above 0, below pi");
  require(vertical_fov_rad > 0 && vertical_fov_rad < M_PI, "vertical_fov_rad", vertical_fov_rad,
          "above 0, below pi");
  require(min_range_m >= 0 && std::isfinite(min_range_m), "min_range_m", min_range_m, "0 or more");
  require(max_range_m > min_range_m && std::isfinite(max_range_m), "max_range_m", max_range_m,
          "above min_range_m, finite");
}

std::vector<Eigen::Vector3d> PinholeCamera::rays(int stride) const {
  std::vector<Eigen::Vector3d> out;
  const double x_scale = std::tan(horizontal_fov_rad / 2), y_scale = std::tan(vertical_fov_rad / 2);
  const int columns = std::max(1, width / stride), rows = std::max(1, height / stride);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      out.push_back(
          Eigen::Vector3d(x_scale * (2 * (i + 0.5) / columns - 1), y_scale * (2 * (j + 0.5) / rows - 1), 1)
              .normalized());
  return out;
}

ViewGains viewGains(const Evaluator& evaluator, const std::vector<Eigen::Matrix4d>& T_map_cameras,
                    const PinholeCamera& camera, int stride, int threads) {
  camera.validate();
  require(stride >= 1, "stride", stride, "1 or more");
  for (std::size_t i = 0; i < T_map_cameras.size(); ++i) requirePose(T_map_cameras[i], i);
  const std::vector<Eigen::Vector3d> rays = camera.rays(stride);
  const std::size_t count = T_map_cameras.size();
  ViewGains out{std::vector<double>(count), std::vector<double>(count), std::vector<double>(count),
                std::vector<double>(count)};
  if (count == 0 || evaluator.frame().size() == 0) return out;
  const int workers = threadCount(threads);
  std::vector<GainCaster> casters(workers, GainCaster(evaluator, camera));
  const double edge = evaluator.map().resolution();
  parallelChunks(static_cast<int>(count), workers, 8, [&](int begin, int end, int thread) {
    for (int i = begin; i < end; ++i) {
      const GainCounts c = casters[thread].cast(T_map_cameras[i], rays);
      out.void_volume_m3[i] = static_cast<double>(c.voids) * edge * edge * edge;
      out.unknown_volume_m3[i] = static_cast<double>(c.unknown) * edge * edge * edge;
      out.frontier_area_m2[i] = static_cast<double>(c.frontier) * edge * edge;
      out.occupied_share[i] = static_cast<double>(c.occupied) / static_cast<double>(rays.size());
    }
  });
  return out;
}

}  // namespace fv
