#include "fv_exploration/occupancy_map.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "lane_kernels.h"
#include "parallel.h"
#include "ray_walk.h"

namespace fv {

namespace {

using Clock = std::chrono::steady_clock;
double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr std::size_t kMaxGrid = std::size_t{1} << 31;  // indices fit into 32 bits

void requireRigid(const Eigen::Matrix4d& T) {
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const bool rigid = T.allFinite() && (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-4 &&
                     R.determinant() > 0 && T.row(3) == Eigen::RowVector4d(0, 0, 0, 1);
  if (rigid) return;
  std::ostringstream text;
  text << "T_map_sensor is [" << T.format(Eigen::IOFormat(6, 0, ", ", "; "))
       << "]; valid: finite and rigid (rotation matrix, last row 0 0 0 1)";
  throw InputError(text.str());
}

octomap::point3d toPoint(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// A scan's points as rays in the map frame, and how many of them became none, or clear only.
struct SortedScan {
  ScanRays rays;
  int64_t no_return = 0, absurd = 0, near = 0;
};

SortedScan sortScan(const Eigen::Ref<const Points>& points, const Eigen::Matrix4d& T, const ScanConfig& scan,
                    const Eigen::Ref<const Points>& directions) {
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const Eigen::Vector3d t = T.topRightCorner<3, 1>();
  const bool directed = directions.rows() > 0 && scan.no_return_clear_m > 0;
  SortedScan out;
  out.rays.origin = toPoint(t);
  out.rays.hits.reserve(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::Vector3d p = points.row(i);
    const double squared = p.squaredNorm();
    if (squared >= kNearestReturn * kNearestReturn && squared <= kFarthestReturn * kFarthestReturn) {
      if (squared >= scan.min_range_m * scan.min_range_m)
        out.rays.hits.push_back(toPoint(R * p + t));
      else
        ++out.near;
    } else if (p.allFinite()) {
      ++out.absurd;
    } else {
      ++out.no_return;
      const Eigen::Vector3d d =
          directed ? Eigen::Vector3d(directions.row(i)) : Eigen::Vector3d::Zero().eval();
      const double length = d.norm();
      if (length > 0 && std::isfinite(length))
        out.rays.cleared.push_back(toPoint(R * (d * (scan.no_return_clear_m / length)) + t));
    }
  }
  return out;
}

}  // namespace

void MapConfig::validate() const {
  const auto probability = [](double p) { return p > 0 && p < 1; };
  require(resolution_m >= 0.001 && resolution_m <= 10, "resolution_m", resolution_m, "0.001 to 10");
  require(prob_hit >= 0.5 && prob_hit < 1, "prob_hit", prob_hit, "0.5 <= prob_hit < 1");
  require(prob_miss > 0 && prob_miss <= 0.5, "prob_miss", prob_miss, "0 < prob_miss <= 0.5");
  require(probability(clamp_max), "clamp_max", clamp_max, "0 < clamp_max < 1");
  require(probability(clamp_min) && clamp_min < clamp_max, "clamp_min", clamp_min,
          "0 < clamp_min < clamp_max");
  require(occupancy_threshold >= clamp_min && occupancy_threshold <= clamp_max, "occupancy_threshold",
          occupancy_threshold, "clamp_min to clamp_max");
  require(threads >= 0 && threads <= 256, "threads", threads, "0 (all cores) to 256");
  require(dense_limit_mb >= 0 && dense_limit_mb <= 1e9, "dense_limit_mb", dense_limit_mb, "0 to 1e9");
  require(bounds_min.has_value() == bounds_max.has_value(), "bounds",
          bounds_min ? "a minimum without a maximum" : "a maximum without a minimum", "both corners or none");
  if (!bounds_min) return;
  const double reach = kKeyOffset * resolution_m;
  for (int i = 0; i < 3; ++i) {
    const double low = (*bounds_min)[i], high = (*bounds_max)[i];
    require(std::isfinite(low) && std::fabs(low) < reach, "bounds_min", low,
            "finite, within 32768 voxels of the origin");
    require(std::isfinite(high) && std::fabs(high) < reach, "bounds_max", high,
            "finite, within 32768 voxels of the origin");
    require(high > low, "bounds_max", high, "above bounds_min in x, y and z");
  }
}

void ScanConfig::validate() const {
  require(min_range_m >= 0 && std::isfinite(min_range_m), "min_range_m", min_range_m, "0 or more, finite");
  require(max_range_m > min_range_m, "max_range_m", max_range_m, "above min_range_m");
  require(no_return_clear_m >= 0 && std::isfinite(no_return_clear_m), "no_return_clear_m", no_return_clear_m,
          "0 (rays without return say nothing) or a range [m]");
}

OccupancyMap::OccupancyMap(const MapConfig& config) : config_(config) {
  config_.validate();
  bestKernels();  // throws here already where FV_INSTRUCTION_SET cannot be used
  bounds_ = {Voxel::Constant(-kKeyOffset), Voxel::Constant(kKeyOffset - 1)};
  if (bounded()) {
    for (int i = 0; i < 3; ++i) {  // voxels whose centre is inside; tolerance for bounds on a centre
      bounds_.min[i] = static_cast<int>(std::ceil((*config_.bounds_min)[i] / resolution() - 0.5 - 1e-6));
      bounds_.max[i] = static_cast<int>(std::floor((*config_.bounds_max)[i] / resolution() - 0.5 + 1e-6));
      require(bounds_.max[i] >= bounds_.min[i], "bounds_max", (*config_.bounds_max)[i],
              "bounds that hold the centre of a voxel");
    }
  }
  makeTree();
  if (!bounded()) return;
  layOut(bounds_.min, bounds_.max);
  fillOutside();
}

OccupancyMap::OccupancyMap(const OccupancyMap& o)
    : config_(o.config_),
      bounds_(o.bounds_),
      tree_(std::make_unique<OccupancyTree>(*o.tree_)),
      frame_(o.frame_),
      classes_(o.classes_),
      tile_sequences_(o.tile_sequences_),
      changed_rows_(o.changed_rows_),
      counts_(o.counts_),
      sequence_(o.sequence_) {
  tree_->clearKeyRays();
}

int OccupancyMap::threads() const { return threadCount(config_.threads); }

void OccupancyMap::makeTree() {
  tree_ = std::make_unique<OccupancyTree>(config_.resolution_m);
  tree_->setProbHit(config_.prob_hit);
  tree_->setProbMiss(config_.prob_miss);
  tree_->setClampingThresMin(config_.clamp_min);
  tree_->setClampingThresMax(config_.clamp_max);
  tree_->setOccupancyThres(config_.occupancy_threshold);
}

void OccupancyMap::layOut(const Voxel& min, const Voxel& max) {
  GridFrame frame;
  for (int i = 0; i < 3; ++i) {
    const int low = floorDiv(min[i], kTile), high = floorDiv(max[i], kTile);
    frame.origin[i] = low * kTile;
    frame.tiles[i] = high - low + 1;
  }
  const double volume = frame.dims().cast<double>().prod();
  require(volume < static_cast<double>(kMaxGrid), "volume in voxels", volume,
          "below 2^31: narrower bounds or larger voxels");
  std::vector<uint8_t> classes(frame.size(), kUnknown);
  std::vector<uint64_t> sequences(frame.tileCount(), sequence_ + 1);
  const int row = frame_.dims().x();
  for (int z = frame_.origin.z(); z < frame_.end().z(); ++z)
    for (int y = frame_.origin.y(); y < frame_.end().y(); ++y) {
      const Voxel start(frame_.origin.x(), y, z);
      std::copy_n(classes_.begin() + frame_.index(start), row, classes.begin() + frame.index(start));
    }
  frame_ = frame;
  classes_.swap(classes);
  tile_sequences_.swap(sequences);
  changed_rows_.assign(frame.tileCount(), RowSet().set());
}

void OccupancyMap::fillOutside() {
  const Voxel end = frame_.end();
  for (int z = frame_.origin.z(); z < end.z(); ++z)
    for (int y = frame_.origin.y(); y < end.y(); ++y)
      for (int x = frame_.origin.x(); x < end.x(); ++x)
        if (!bounds_.contains({x, y, z})) classes_[frame_.index({x, y, z})] = kOutside;
}

/// Grow an unbounded frame until it holds the box and a margin of unknown voxels.
void OccupancyMap::makeRoom(const Voxel& min, const Voxel& max) {
  const Voxel one = Voxel::Ones();
  if (frame_.tileCount() > 0 && frame_.contains(min - one) && frame_.contains(max + one)) return;
  Voxel low = min - 2 * one, high = max + 2 * one;
  if (frame_.tileCount() > 0) {
    const Voxel slack = frame_.dims() / 4;  // geometric growth: each voxel is copied a few times only
    for (int i = 0; i < 3; ++i) {
      if (low[i] < frame_.origin[i]) low[i] -= slack[i];
      if (high[i] >= frame_.end()[i]) high[i] += slack[i];
    }
    low = low.cwiseMin(frame_.origin);
    high = high.cwiseMax(frame_.end() - one);
  }
  layOut(low, high);
}

void OccupancyMap::record(const std::vector<Change>& changes) {
  for (const Change& c : changes) {
    classes_[frame_.index(c.voxel)] = c.after;
    const int tile = frame_.tileOf(c.voxel);
    if (tile_sequences_[tile] != sequence_) changed_rows_[tile].reset();
    tile_sequences_[tile] = sequence_;
    changed_rows_[tile].set((c.voxel.y() & (kTile - 1)) + kTile * (c.voxel.z() & (kTile - 1)));
    --counts_[c.before];
    ++counts_[c.after];
  }
}

InsertResult OccupancyMap::finish(std::vector<Change> changes, InsertResult result) {
  ++sequence_;
  record(changes);
  result.counts["changed"] = static_cast<int64_t>(changes.size());
  result.changes = std::move(changes);
  result.sequence = sequence_;
  return result;
}

InsertResult OccupancyMap::insertScan(const Eigen::Ref<const Points>& points_sensor,
                                      const Eigen::Matrix4d& T_map_sensor, const ScanConfig& scan,
                                      const Eigen::Ref<const Points>& directions_sensor) {
  const auto start = Clock::now();
  scan.validate();
  requireRigid(T_map_sensor);
  if (directions_sensor.rows() > 0)
    require(directions_sensor.rows() == points_sensor.rows(), "rows of ray_directions",
            directions_sensor.rows(), "as many as points");
  requireInKeys(T_map_sensor.topRightCorner<3, 1>());
  SortedScan sorted = sortScan(points_sensor, T_map_sensor, scan, directions_sensor);
  const auto rays = static_cast<int64_t>(sorted.rays.hits.size() + sorted.rays.cleared.size());
  const double rays_s = secondsSince(start);
  InsertResult result =
      insertRays(std::move(sorted.rays), std::isinf(scan.max_range_m) ? -1.0 : scan.max_range_m);
  result.counts["points"] = points_sensor.rows();
  result.counts["dropped"] = points_sensor.rows() - rays;
  result.counts["no_return"] = sorted.no_return;
  result.counts["absurd"] = sorted.absurd;
  result.counts["near"] = sorted.near;
  result.timings["rays"] = rays_s;
  result.timings["total"] = secondsSince(start);
  return result;
}

void OccupancyMap::requireInKeys(const Eigen::Vector3d& sensor) const {
  Voxel v;
  if (RayMaker(resolution()).voxel(toPoint(sensor), v)) return;
  const Eigen::IOFormat row(10, Eigen::DontAlignCols, ", ", ", ", "", "", "(", ")");
  const Eigen::Vector3d shift = -sensor.array().round();
  std::ostringstream text;
  text << "the sensor is at " << sensor.transpose().format(row) << " m; valid: within "
       << kKeyOffset * resolution() << " m of the map's origin along each axis (" << kKeyOffset
       << " voxels of " << resolution() << " m): shift all positions by about "
       << shift.transpose().format(row) << " m";
  throw OutsideKeysError(text.str());
}

InsertResult OccupancyMap::insertRays(ScanRays rays, double max_range_m) {
  InsertResult result;
  auto start = Clock::now();
  const std::size_t cleared = rays.cleared.size();
  if (max_range_m >= 0) {
    const auto far = [&](const octomap::point3d& p) { return (p - rays.origin).norm() > max_range_m; };
    std::vector<octomap::point3d> near;
    near.reserve(rays.hits.size());
    for (const octomap::point3d& p : rays.hits) {
      if (far(p))
        rays.cleared.push_back(rays.origin +
                               (p - rays.origin).normalized() * static_cast<float>(max_range_m));
      else
        near.push_back(p);
    }
    rays.hits.swap(near);
  }
  const auto far = static_cast<int64_t>(rays.cleared.size() - cleared);
  MarkCounts counts;
  std::vector<MarkBlock> blocks = markScan(rays, resolution(), bounds_, threads(),
                                           static_cast<std::size_t>(config_.dense_limit_mb * 1e6), counts);
  result.timings["mark"] = secondsSince(start);
  if (!bounded() && !blocks.empty()) {
    Voxel low = blocks[0].block, high = blocks[0].block;
    for (const MarkBlock& b : blocks) {
      low = low.cwiseMin(b.block);
      high = high.cwiseMax(b.block);
    }
    makeRoom(low * kBlock, high * kBlock + Voxel::Constant(kBlock - 1));
  }
  start = Clock::now();
  std::vector<Change> changes = tree_->apply(blocks, threads());
  result.timings["tree"] = secondsSince(start);
  result.counts = {{"rays", counts.rays},       {"hits", counts.hits}, {"far", far},
                   {"outside", counts.outside}, {"free", counts.free}, {"occupied", counts.occupied}};
  start = Clock::now();
  result = finish(std::move(changes), std::move(result));
  result.timings["classes"] = secondsSince(start);
  return result;
}

bool OccupancyMap::voxelAt(const Eigen::Vector3d& point, Voxel& v) const {
  for (int i = 0; i < 3; ++i) {
    const double scaled = std::floor(point[i] * (1. / resolution()));
    if (!(scaled >= bounds_.min[i] && scaled <= bounds_.max[i])) return false;
    v[i] = static_cast<int>(scaled);
  }
  return true;
}

InsertResult OccupancyMap::markFree(const Eigen::Ref<const Points>& points) {
  std::vector<Change> changes;
  InsertResult result;
  Voxels inside(points.rows(), 3);
  Eigen::Index count = 0;
  Voxel v;
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    if (voxelAt(points.row(i), v)) inside.row(count++) = v;
  if (count > 0 && !bounded())
    makeRoom(inside.topRows(count).colwise().minCoeff(), inside.topRows(count).colwise().maxCoeff());
  for (Eigen::Index i = 0; i < count; ++i) {
    v = inside.row(i);
    const octomap::OcTreeKey key = tree_->key(v);
    const Class before = tree_->classOf(tree_->search(key));
    tree_->setNodeValue(key, tree_->getClampingThresMinLog(), false);
    if (before != kFree) changes.push_back({v, before, kFree});
  }
  result.counts = {{"points", points.rows()}, {"inside", count}};
  return finish(std::move(changes), std::move(result));
}

std::vector<int8_t> OccupancyMap::classify(const Eigen::Ref<const Points>& points) const {
  std::vector<int8_t> out(points.rows(), -1);
  Voxel v;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!voxelAt(points.row(i), v)) continue;
    const Class c = classOf(v);
    out[i] = c == kFree ? 0 : c == kOccupied ? 1 : -1;
  }
  return out;
}

PointsF OccupancyMap::voxels(Class which) const {
  require(which != kUnknown || bounded(), "kind", "unknown", "free or occupied in a map without bounds");
  PointsF out(count(which), 3);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < classes_.size(); ++i)
    if (classes_[i] == which) out.row(row++) = centre(frame_.voxel(i)).cast<float>();
  return out;
}

int64_t OccupancyMap::count(Class which) const {
  if (which != kUnknown) return counts_[which];
  if (!bounded()) return 0;
  return (bounds_.max - bounds_.min + Voxel::Ones()).cast<int64_t>().prod() - counts_[kFree] -
         counts_[kOccupied];
}

double OccupancyMap::volume() const {
  require(bounded(), "bounds", "none", "a map with bounds_min and bounds_max");
  return (bounds_.max - bounds_.min + Voxel::Ones()).cast<double>().prod() * std::pow(resolution(), 3);
}

double OccupancyMap::knownShare() const {
  const double all = volume() / std::pow(resolution(), 3);
  return static_cast<double>(counts_[kFree] + counts_[kOccupied]) / all;
}

}  // namespace fv
