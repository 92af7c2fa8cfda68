#include "body_voxels.h"

#include <cmath>
#include <cstdint>
#include <set>
#include <tuple>

#include "internal.h"

namespace fv_robot_model {
namespace {

using Key = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

constexpr double kMostVoxels = 50e6;
/// Projections back and forth between a voxel and a shape: many more than needed to tell all but a hair's
/// touch.
constexpr int kProjections = 300;

/// A shape grown by its padding, where it stands on the map.
struct PlacedShape {
  const Shape& shape;
  Eigen::Isometry3d T_map_shape;
  double padding_m;
};

Eigen::AlignedBox3d boxInMap(const PlacedShape& placed) {
  const Eigen::AlignedBox3d box = boundingBox(placed.shape);
  const Eigen::Vector3d center = placed.T_map_shape * box.center();
  const Eigen::Vector3d half = placed.T_map_shape.linear().cwiseAbs() * (0.5 * box.sizes());
  return {(center - half).array() - placed.padding_m, (center + half).array() + placed.padding_m};
}

/// Does the closed cube share a point with the grown shape? Alternating projections between two convex bodies
/// converge to their nearest points (Cheney and Goldstein, 1959), and each of them lies in the cube, so yes
/// is always true.
bool voxelMeets(const PlacedShape& placed, const Eigen::Vector3d& center_map, double half_edge) {
  const Eigen::Isometry3d T_shape_map = placed.T_map_shape.inverse();
  const Eigen::Vector3d center_shape = T_shape_map * center_map;
  if (!isWithin(placed.shape, center_shape, placed.padding_m + std::sqrt(3.0) * half_edge)) return false;
  if (isWithin(placed.shape, center_shape, placed.padding_m)) return true;
  Eigen::Vector3d p_map = center_map;
  for (int i = 0; i < kProjections; ++i) {
    const Eigen::Vector3d near_map = placed.T_map_shape * closestPoint(placed.shape, T_shape_map * p_map);
    if ((near_map - p_map).norm() <= placed.padding_m) return true;
    const Eigen::Vector3d offset = near_map - center_map;
    const Eigen::Vector3d next = center_map + offset.cwiseMin(half_edge).cwiseMax(-half_edge);
    if ((next - p_map).norm() < 1e-9) return false;
    p_map = next;
  }
  return (T_shape_map * p_map - closestPoint(placed.shape, T_shape_map * p_map)).norm() <= placed.padding_m;
}

void addVoxels(const PlacedShape& placed, double resolution_m, std::set<Key>& keys) {
  const Eigen::AlignedBox3d box = boxInMap(placed);
  const Eigen::Vector3d lowest = (box.min() / resolution_m).array().floor();
  const Eigen::Vector3d highest = (box.max() / resolution_m).array().floor();
  const double count = ((highest - lowest).array() + 1.0).prod();
  if (!(count <= kMostVoxels))
    throw std::invalid_argument(
        text("a body of ", count, " voxels of ", resolution_m, " m is too much; at most ", kMostVoxels));
  const auto low = lowest.cast<std::int64_t>().eval();
  const auto high = highest.cast<std::int64_t>().eval();
  for (std::int64_t x = low.x(); x <= high.x(); ++x)
    for (std::int64_t y = low.y(); y <= high.y(); ++y)
      for (std::int64_t z = low.z(); z <= high.z(); ++z) {
        const Eigen::Vector3d center = resolution_m * (Eigen::Vector3d(x, y, z).array() + 0.5);
        if (voxelMeets(placed, center, 0.5 * resolution_m)) keys.emplace(x, y, z);
      }
}

void checkArguments(const Eigen::Isometry3d& T_map_root, double resolution_m, double padding_m) {
  if (!T_map_root.matrix().allFinite()) throw std::invalid_argument("T_map_root is not finite");
  if (!std::isfinite(resolution_m) || resolution_m <= 0.0)
    throw std::invalid_argument(text("resolution_m must be finite and positive, got ", resolution_m));
  if (!std::isfinite(padding_m) || padding_m < 0.0)
    throw std::invalid_argument(text("padding_m must be finite and not negative, got ", padding_m));
}

}  // namespace

Points bodyVoxels(const RobotModel& model, const LinkPoses& poses, const Eigen::Isometry3d& T_map_root,
                  double resolution_m, double padding_m) {
  checkPoses(poses, model.linkNames().size());
  checkArguments(T_map_root, resolution_m, padding_m);
  std::set<Key> keys;
  for (std::size_t i = 0; i < poses.size(); ++i)
    for (const Shape& shape : model.shapes(static_cast<int>(i)))
      addVoxels({shape, T_map_root * poses[i] * shape.T_link_shape, padding_m}, resolution_m, keys);
  Points centers(keys.size(), 3);
  Eigen::Index row = 0;
  for (const auto& [x, y, z] : keys)
    centers.row(row++) = resolution_m * (Eigen::RowVector3d(x, y, z).array() + 0.5);
  return centers;
}

}  // namespace fv_robot_model
