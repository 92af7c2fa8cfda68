#include "fv_exploration/view_gain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "big_vector.h"
#include "lane_kernels.h"
#include "parallel.h"

namespace fv {

namespace {

GainTable gainTable() {
  GainTable table;
  for (int flags = 0; flags < kViewStep; ++flags) {
    const int kind = flags & kClassMask;
    table.adds[flags] = 0;
    if (kind == kUnknown) table.adds[flags] += GainTable::kOneUnknown;
    if (flags & kVoidFlag) table.adds[flags] += GainTable::kOneVoid;
    if (flags & kFrontierFlag) table.adds[flags] += GainTable::kOneFrontier;
    table.open[flags] = kind == kOccupied ? 0 : -1;
  }
  return table;
}
const GainTable kGainTable = gainTable();

/// Voxels and rays of a view, each times the chance of the rays that met it.
struct WeightedCounts {
  double voids = 0, unknown = 0, frontier = 0, occupied = 0;
};

/// Casts the rays of one view at a time; remembers which voxels the view has counted.
class GainCaster {
 public:
  GainCaster(const Evaluator& evaluator, const PinholeCamera& camera)
      : frame_(evaluator.frame()),
        flags_(evaluator.flags()),
        factor_(1.0 / evaluator.map().resolution()),
        min_range_(camera.min_range_m * factor_),
        max_range_(camera.max_range_m * factor_),
        cells_(flags_.begin(), flags_.end()) {
    stride_[0] = 1;
    stride_[1] = frame_.dims().x();
    stride_[2] = stride_[1] * frame_.dims().y();
  }

  /// @param chances, reaches_m of the rays, or null. The rays of highest chance go first: a voxel counts with
  /// that of the first eight rays that meet it.
  WeightedCounts cast(const Eigen::Matrix4d& T_map_camera, const std::vector<Eigen::Vector3d>& rays,
                      const float* chances, const float* reaches_m) {
    view_ = static_cast<uint16_t>(view_ + kViewStep);
    if (view_ == 0) {  // numbers are used up
      std::copy(flags_.begin(), flags_.end(), cells_.begin());
      view_ = kViewStep;
    }
    WeightedCounts sums;
    const Eigen::Vector3d origin =
        T_map_camera.topRightCorner<3, 1>() * factor_ - frame_.origin.cast<double>();
    const Eigen::Matrix3d R = T_map_camera.topLeftCorner<3, 3>();
    LaneRays lanes;
    int filled = 0;
    double chance = 0;
    for (const int ray : order(chances, rays.size())) {
      const double end = reaches_m ? std::min(max_range_, reaches_m[ray] * factor_) : max_range_;
      if (!prepare(origin, R * rays[ray], end, lanes, filled)) continue;
      chance += chances ? chances[ray] : 1.0;
      if (++filled < kLanes) continue;
      castLanes(lanes, chance / filled, sums);
      filled = 0;
      chance = 0;
    }
    if (filled == 0) return sums;
    const int last = filled;
    while (filled < kLanes) lanes.clear(filled++);
    castLanes(lanes, chance / last, sums);
    return sums;
  }

 private:
  /// Rays of any chance, highest first in steps of 1/32; rays of one step keep their order.
  const std::vector<int>& order(const float* chances, std::size_t count) {
    order_.clear();
    if (!chances) {
      for (std::size_t i = 0; i < count; ++i) order_.push_back(static_cast<int>(i));
      return order_;
    }
    for (auto& step : steps_) step.clear();
    for (std::size_t i = 0; i < count; ++i)
      if (chances[i] > 0) steps_[std::min(kSteps - 1, static_cast<int>(chances[i] * kSteps))].push_back(i);
    for (auto step = steps_.rbegin(); step != steps_.rend(); ++step)
      order_.insert(order_.end(), step->begin(), step->end());
    return order_;
  }

  void castLanes(const LaneRays& lanes, double chance, WeightedCounts& sums) {
    GainCounts counts;
    kernels_.castLanes(lanes, GainGrid{&kGainTable, cells_.data(), view_, min_range_}, counts);
    sums.voids += chance * counts.voids;
    sums.unknown += chance * counts.unknown;
    sums.frontier += chance * counts.frontier;
    sums.occupied += chance * counts.occupied;
  }

  /// Put a ray into a lane; false when it misses the grid.
  bool prepare(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double end, LaneRays& lanes,
               int lane) const {
    double begin = 0;
    if (!clipToGrid(origin, direction, frame_.dims(), begin, end)) return false;
    GridWalk walk;
    for (int i = 0; i < 3; ++i) walk.begin(i, origin[i], direction[i], begin, frame_.dims()[i], stride_[i]);
    lanes.set(lane, walk, end);
    return true;
  }

  const GridFrame& frame_;
  const std::vector<uint8_t>& flags_;
  double factor_, min_range_, max_range_;  // ranges in voxels
  int64_t stride_[3];
  const LaneKernels& kernels_ = bestKernels();
  BigVector<uint16_t> cells_;  // see GainGrid
  uint16_t view_ = 0;
  static constexpr int kSteps = 32;
  std::array<std::vector<int>, kSteps> steps_;
  std::vector<int> order_;
};

}  // namespace

void requireRigid(const Eigen::Matrix4d& T, const std::string& name) {
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if (T.allFinite() && (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-4 && R.determinant() > 0)
    return;
  throw InputError(name + " is not a finite rigid transform; valid: rotation and translation");
}

std::string viewName(std::size_t view) { return "T_map_cameras[" + std::to_string(view) + "]"; }

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

int PinholeCamera::rayThrough(const Eigen::Vector3d& p) const {
  if (!(p.z() > 0)) return -1;
  const double u = (p.x() / (p.z() * std::tan(horizontal_fov_rad / 2)) + 1) / 2 * width;
  const double v = (p.y() / (p.z() * std::tan(vertical_fov_rad / 2)) + 1) / 2 * height;
  if (!(u >= 0 && u < width && v >= 0 && v < height)) return -1;
  return static_cast<int>(v) * width + static_cast<int>(u);
}

ViewGains viewGains(const Evaluator& evaluator, const std::vector<Eigen::Matrix4d>& T_map_cameras,
                    const PinholeCamera& camera, int stride, int threads, const RayOutlook& outlook) {
  camera.validate();
  require(stride >= 1, "stride", stride, "1 or more");
  for (std::size_t i = 0; i < T_map_cameras.size(); ++i) requireRigid(T_map_cameras[i], viewName(i));
  const std::vector<Eigen::Vector3d> rays = camera.rays(stride);
  const std::size_t count = T_map_cameras.size();
  for (const auto* numbers : {&outlook.chance, &outlook.reach_m})
    if (!numbers->empty())
      require(numbers->size() == count * rays.size(), "size of the outlook", numbers->size(),
              "one number for each ray of each view");
  ViewGains out{std::vector<double>(count), std::vector<double>(count), std::vector<double>(count),
                std::vector<double>(count)};
  if (count == 0 || evaluator.frame().size() == 0) return out;
  const int workers = threadCount(threads);
  std::vector<GainCaster> casters(workers, GainCaster(evaluator, camera));
  const double edge = evaluator.map().resolution();
  parallelChunks(static_cast<int>(count), workers, 8, [&](int begin, int end, int thread) {
    for (int i = begin; i < end; ++i) {
      const auto row = [&](const std::vector<float>& all) {
        return all.empty() ? nullptr : &all[i * rays.size()];
      };
      const WeightedCounts c =
          casters[thread].cast(T_map_cameras[i], rays, row(outlook.chance), row(outlook.reach_m));
      out.void_volume_m3[i] = c.voids * edge * edge * edge;
      out.unknown_volume_m3[i] = c.unknown * edge * edge * edge;
      out.frontier_area_m2[i] = c.frontier * edge * edge;
      out.occupied_share[i] = c.occupied / static_cast<double>(rays.size());
    }
  });
  return out;
}

}  // namespace fv
