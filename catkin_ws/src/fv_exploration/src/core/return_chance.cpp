#include "return_chance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grid_walk.h"
#include "parallel.h"

namespace fv {

namespace {

/// Before there is experience: as if so many scans had come back from half the range. A camera that begins
/// with a look into the open must not give up at once.
constexpr double kPriorScans = 0.25;
/// What a cell of no experience is held for weighs as much as so many rays: one ray settles it nearly. With a
/// whole ray in its place, views into the open kept promising ten times what they showed (world shelf).
constexpr float kPriorRays = 0.02f;
/// A ray that is this unlikely to be still on its way is not followed further.
constexpr float kGone = 0.01f;
/// A cell that sends back more than this is a surface: a ray without return says nothing of what lies behind.
constexpr float kSurface = 0.5f;
/// A cell that sends back more than this ends what a ray can show. Less than half: an edge fills only a part
/// of its cell, and views past edges into the open would promise everything that lies behind them.
constexpr float kEnd = 0.2f;

constexpr double kMostCells = 1 << 29;

}  // namespace

/// A ray on its way from cell to cell; lengths in cells.
class ReturnChance::Walk {
 public:
  Walk(const ReturnChance& grid, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
       double from_m, double to_m) {
    const Eigen::Vector3d start = (origin - grid.corner_) / grid.cell_m_;
    begin_ = from_m / grid.cell_m_;
    end_ = to_m / grid.cell_m_;
    live_ = clipToGrid(start, direction, grid.dims_, begin_, end_);
    if (!live_) return;
    int64_t stride = 1;
    for (int i = 0; i < 3; ++i) {
      walk_.begin(i, start[i], direction[i], begin_, grid.dims_[i], stride);
      stride *= grid.dims_[i];
    }
  }

  bool live() const { return live_; }
  int64_t cell() const { return walk_.at; }
  /// Length at which the ray leaves the cell.
  double leaves() const { return std::min({walk_.t[0], walk_.t[1], walk_.t[2], end_}); }

  void advance() {
    const int axis =
        walk_.t[0] <= walk_.t[1] ? (walk_.t[0] <= walk_.t[2] ? 0 : 2) : (walk_.t[1] <= walk_.t[2] ? 1 : 2);
    live_ = walk_.t[axis] < end_ && walk_.left[axis]-- > 0;
    if (!live_) return;
    walk_.at += walk_.step[axis];
    walk_.t[axis] += walk_.delta[axis];
  }

 private:
  GridWalk walk_;
  double begin_, end_;
  bool live_;
};

ReturnChance::ReturnChance(const Eigen::Vector3d& bounds_min, const Eigen::Vector3d& bounds_max,
                           double cell_m, const PinholeCamera& camera)
    : camera_(camera), cell_m_(cell_m) {
  camera.validate();
  require(std::isfinite(cell_m) && cell_m > 0, "cell_m", cell_m, "above 0");
  rays_ = camera.rays(1);
  corner_ = bounds_min.array() - camera.max_range_m;
  const Eigen::Vector3d size = (bounds_max - bounds_min).array() + 2 * camera.max_range_m;
  const double count = (size / cell_m).prod();
  if (!((bounds_max - bounds_min).minCoeff() > 0 && count < kMostCells))
    throw InputError(
        "the bounds hold no volume, or one of more than 2^29 cells with the sensor's range about it; "
        "valid: finite corners, each minimum below its maximum, a larger cell_m");
  for (int i = 0; i < 3; ++i) dims_[i] = static_cast<int>(std::ceil(size[i] / cell_m));
  cells_.resize(static_cast<std::size_t>(dims_[0]) * dims_[1] * dims_[2]);
  tabulate();
}

double ReturnChance::prior() const {
  const double rays = kPriorScans * rayCount(), half_way = camera_.max_range_m / (2 * cell_m_);
  return (first_hits_ + rays) / (first_hits_ + first_passes_ + rays * (1 + half_way));
}

void ReturnChance::tabulate() {
  const double before = prior() * kPriorRays;
  for (int hits = 0; hits <= kMost; ++hits)
    for (int passes = 0; passes <= kMost; ++passes)
      reflects_[hits * (kMost + 1) + passes] =
          static_cast<float>((hits + before) / (hits + passes + kPriorRays));
}

void ReturnChance::count(int64_t cell, bool hit) {
  Counts& counts = cells_[cell];
  if (counts.hits + counts.passes == 0) ++(hit ? first_hits_ : first_passes_);
  uint8_t& more = hit ? counts.hits : counts.passes;
  if (more == kMost) {
    counts.hits /= 2;
    counts.passes /= 2;
  }
  ++more;
}

float ReturnChance::reflects(int64_t cell) const {
  const Counts& counts = cells_[cell];
  return reflects_[counts.hits * (kMost + 1) + counts.passes];
}

void ReturnChance::learn(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double range_m,
                         bool returned) {
  Walk walk(*this, origin, direction, returned ? 0.0 : camera_.min_range_m, range_m);
  while (walk.live()) {
    const int64_t cell = walk.cell();
    walk.advance();
    if (!returned && reflects(cell) > kSurface) return;
    count(cell, returned && !walk.live());
  }
}

void ReturnChance::note(const Eigen::Matrix4d& T_map_sensor, const Points& points_sensor,
                        const std::vector<uint8_t>& hidden) {
  requireRigid(T_map_sensor, "T_map_sensor");
  if (!hidden.empty())
    require(hidden.size() == rays_.size(), "size of hidden", hidden.size(), "one for each ray");
  const double kNone = std::numeric_limits<double>::infinity();
  std::vector<double> ranges(rays_.size(), kNone);
  for (Eigen::Index i = 0; i < points_sensor.rows(); ++i) {
    const double range = points_sensor.row(i).norm();
    if (!(range >= camera_.min_range_m && range <= camera_.max_range_m)) continue;
    const int ray = camera_.rayThrough(points_sensor.row(i));
    if (ray >= 0) ranges[ray] = std::min(ranges[ray], range);
  }
  const Eigen::Vector3d origin = T_map_sensor.topRightCorner<3, 1>();
  const Eigen::Matrix3d R = T_map_sensor.topLeftCorner<3, 3>();
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (!hidden.empty() && hidden[i]) continue;
    const bool returned = ranges[i] < kNone;
    learn(origin, R * rays_[i], returned ? ranges[i] : camera_.max_range_m, returned);
  }
  tabulate();
}

void ReturnChance::expect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float& chance,
                          float& reach_m) const {
  const double seen_from = camera_.min_range_m / cell_m_;
  float going = 1;
  chance = 0;
  reach_m = static_cast<float>(camera_.max_range_m);
  for (Walk walk(*this, origin, direction, 0.0, camera_.max_range_m); walk.live(); walk.advance()) {
    const float reflects_here = reflects(walk.cell()), back = going * reflects_here;
    const double leaves = walk.leaves();
    if (leaves > seen_from) chance += back;  // what is nearer stops the ray, and is not seen
    going -= back;
    if (reflects_here > kEnd) reach_m = std::min(reach_m, static_cast<float>((leaves + 1) * cell_m_));
    if (going < kGone) break;
  }
}

RayOutlook ReturnChance::outlook(const std::vector<Eigen::Matrix4d>& T_map_cameras, int stride,
                                 int threads) const {
  require(stride >= 1, "stride", stride, "1 or more");
  for (std::size_t i = 0; i < T_map_cameras.size(); ++i) requireRigid(T_map_cameras[i], viewName(i));
  const std::vector<Eigen::Vector3d> walked = camera_.rays(stride);
  const std::vector<int> source = nearestOf(stride);
  const std::size_t count = T_map_cameras.size() * rays_.size();
  RayOutlook out{std::vector<float>(count), std::vector<float>(count)};
  parallelChunks(static_cast<int>(T_map_cameras.size()), threadCount(threads), 8,
                 [&](int begin, int end, int) {
                   std::vector<float> chance(walked.size()), reach_m(walked.size());
                   for (int view = begin; view < end; ++view) {
                     const Eigen::Vector3d origin = T_map_cameras[view].topRightCorner<3, 1>();
                     const Eigen::Matrix3d R = T_map_cameras[view].topLeftCorner<3, 3>();
                     for (std::size_t i = 0; i < walked.size(); ++i)
                       expect(origin, R * walked[i], chance[i], reach_m[i]);
                     std::size_t at = view * rays_.size();
                     for (const int from : source) {
                       out.chance[at] = chance[from];
                       out.reach_m[at++] = reach_m[from];
                     }
                   }
                 });
  return out;
}

std::vector<int> ReturnChance::nearestOf(int stride) const {
  const int columns = std::max(1, camera_.width / stride), rows = std::max(1, camera_.height / stride);
  std::vector<int> source;
  for (int j = 0; j < camera_.height; ++j)
    for (int i = 0; i < camera_.width; ++i)
      source.push_back(j * rows / camera_.height * columns + i * columns / camera_.width);
  return source;
}

}  // namespace fv
