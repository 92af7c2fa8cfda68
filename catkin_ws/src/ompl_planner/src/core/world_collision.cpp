#include "world_collision.h"

#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <fv_robot_model/fcl_geometry.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace ompl_planner {
namespace {

using fv_robot_model::Shape;

constexpr double kAllowanceSlack = 0.001;  // [m] else rounding decides whether the start itself is allowed
constexpr double kRemainingShare = 0.1;    // of a shape's size, however much it is shrunk

CollisionBody makeBody(const Shape& shape) {
  return {shape, fv_robot_model::fclGeometry(shape), fv_robot_model::boundingBox(shape), nullptr};
}

double shrunkenRadius(double radius, double depth) {
  return std::max(radius - depth, kRemainingShare * radius);
}

double shrunkenEdge(double edge, double depth) {
  return std::max(edge - 2.0 * depth, kRemainingShare * edge);
}

/// Axis-aligned box in the map frame around a box in a shape's frame.
Eigen::AlignedBox3d mapBounds(const Eigen::AlignedBox3d& bounds, const Eigen::Isometry3d& T_map_shape) {
  const Eigen::Vector3d center = T_map_shape * bounds.center();
  const Eigen::Vector3d half = T_map_shape.linear().cwiseAbs() * (0.5 * bounds.sizes());
  return {center - half, center + half};
}

}  // namespace

std::string describe(const fv_robot_model::RobotModel& model, const WorldContact& contact) {
  char text[128];
  std::snprintf(text, sizeof(text), " voxel at (%.3f, %.3f, %.3f)", contact.p_map.x(), contact.p_map.y(),
                contact.p_map.z());
  return "link '" + model.linkNames().at(static_cast<std::size_t>(contact.link)) + "' meets the " +
         (contact.kind == Voxel::Occupied ? "occupied" : "unknown") + text;
}

VoxelGrid applyPolicy(const VoxelGrid& map, UnknownSpace policy, const fv_robot_model::RobotModel& model,
                      const fv_robot_model::Group& group, const fv_robot_model::LinkPoses& start_poses,
                      const Eigen::Isometry3d& T_map_root, double bubble_radius_m) {
  VoxelGrid grid = map;
  if (policy == UnknownSpace::Free) {
    for (std::size_t i = 0; i < grid.count(); ++i) {
      if (grid.atOffset(i) == Voxel::Unknown) grid.setOffset(i, Voxel::Free);
    }
  }
  if (policy != UnknownSpace::FreeNearStart) return grid;
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(bubble_radius_m);
  for (const int link : group.moved_links) {
    for (const Shape& shape : model.shapes(link)) {
      const Eigen::Isometry3d T_map_shape =
          T_map_root * start_poses[static_cast<std::size_t>(link)] * shape.T_link_shape;
      const Eigen::AlignedBox3d box = mapBounds(fv_robot_model::boundingBox(shape), T_map_shape);
      const Eigen::Isometry3d T_shape_map = T_map_shape.inverse();
      const VoxelIndex low = grid.indexOf(box.min() - reach).cwiseMax(grid.origin());
      const VoxelIndex high =
          grid.indexOf(box.max() + reach).cwiseMin(grid.origin() + grid.size() - VoxelIndex::Ones());
      for (int x = low.x(); x <= high.x(); ++x) {
        for (int y = low.y(); y <= high.y(); ++y) {
          for (int z = low.z(); z <= high.z(); ++z) {
            const VoxelIndex index(x, y, z);
            if (grid.at(index) != Voxel::Unknown) continue;
            if (fv_robot_model::isWithin(shape, T_shape_map * grid.centerOf(index), bubble_radius_m)) {
              grid.set(index, Voxel::Free);
            }
          }
        }
      }
    }
  }
  return grid;
}

Shape shrunken(const Shape& shape, double depth_m) {
  if (depth_m <= 0.0) return shape;
  Shape small = shape;
  const Eigen::Vector3d& d = shape.dimensions;
  switch (shape.kind) {
    case Shape::Kind::Box:
      small.dimensions = {shrunkenEdge(d.x(), depth_m), shrunkenEdge(d.y(), depth_m),
                          shrunkenEdge(d.z(), depth_m)};
      return small;
    case Shape::Kind::Cylinder:
      small.dimensions = {shrunkenRadius(d.x(), depth_m), shrunkenEdge(d.y(), depth_m), 0.0};
      return small;
    case Shape::Kind::Sphere:
      small.dimensions.x() = shrunkenRadius(d.x(), depth_m);
      return small;
    case Shape::Kind::Convex:
      break;
  }
  // Scaling about the box's centre moves each face inwards by its distance from there times (1 - factor); the
  // nearest face sets the factor, so that no face moves less than depth_m.
  const Eigen::Vector3d center = fv_robot_model::boundingBox(shape).center();
  const double inner = -fv_robot_model::signedDistance(shape, center);
  const double factor = inner > 0.0 ? std::max(1.0 - depth_m / inner, kRemainingShare) : kRemainingShare;
  return fv_robot_model::scaled(shape, factor);
}

std::shared_ptr<const LinkBodies> paddedBodies(const fv_robot_model::RobotModel& model,
                                               const fv_robot_model::Group& group, double padding_m) {
  auto bodies = std::make_shared<LinkBodies>();
  for (const int link : group.moved_links) {
    for (const Shape& shape : model.shapes(link)) {
      CollisionBody body = makeBody(padding_m > 0.0 ? fv_robot_model::padded(shape, padding_m) : shape);
      if (shape.kind == Shape::Kind::Convex) body.faces = std::make_shared<const HullFaces>(body.shape);
      (*bodies)[link].push_back(std::move(body));
    }
  }
  return bodies;
}

WorldCollision::WorldCollision(std::shared_ptr<const LinkBodies> bodies, const Eigen::Isometry3d& T_map_root,
                               std::shared_ptr<const VoxelGrid> grid, bool outside_is_free,
                               std::shared_ptr<const ObstacleBlocks> blocks)
    : T_map_root_(T_map_root),
      grid_(std::move(grid)),
      blocks_(std::move(blocks)),
      outside_is_free_(outside_is_free),
      bodies_(std::move(bodies)) {
  const double edge = grid_->resolution();
  voxel_box_ = std::make_shared<fcl::Boxd>(edge, edge, edge);
}

std::optional<WorldContact> WorldCollision::firstContact(const fv_robot_model::LinkPoses& poses) const {
  for (const auto& [link, bodies] : *bodies_) {
    if (auto contact = contactOf(poses, link)) return contact;
  }
  return std::nullopt;
}

std::optional<WorldContact> WorldCollision::contactOf(const fv_robot_model::LinkPoses& poses,
                                                      int link) const {
  return linkContact(link, bodies_->at(link), T_map_root_ * poses[static_cast<std::size_t>(link)], nullptr);
}

std::optional<WorldContact> WorldCollision::contactAtDepth(const fv_robot_model::LinkPoses& poses, int link,
                                                           double depth_m) const {
  const Eigen::Isometry3d T_map_link = T_map_root_ * poses[static_cast<std::size_t>(link)];
  std::vector<std::size_t> voxels;
  const auto bodies = shrunkenBodies(link, depth_m);
  return linkContact(link, bodies, T_map_link, &voxels);
}

std::optional<WorldContact> WorldCollision::allowStart(const fv_robot_model::LinkPoses& poses,
                                                       double max_depth_m) {
  constexpr int kSteps = 4;
  allowance_.links.clear();
  StartAllowance allowance;
  for (const auto& [link, bodies] : *bodies_) {
    const Eigen::Isometry3d T_map_link = T_map_root_ * poses[static_cast<std::size_t>(link)];
    std::vector<std::size_t> voxels;
    if (!linkContact(link, bodies, T_map_link, &voxels)) continue;
    std::optional<WorldContact> deeper;
    for (int step = 1; step <= kSteps; ++step) {
      const double depth = max_depth_m * step / kSteps;
      deeper = contactAtDepth(poses, link, depth);
      if (deeper) continue;
      const double allowed = depth + kAllowanceSlack;
      allowance.links[link] = {{voxels.begin(), voxels.end()}, allowed, shrunkenBodies(link, allowed)};
      break;
    }
    if (deeper) return deeper;
  }
  allowance_ = std::move(allowance);
  return std::nullopt;
}

std::vector<CollisionBody> WorldCollision::shrunkenBodies(int link, double depth_m) const {
  std::vector<CollisionBody> bodies;
  for (const CollisionBody& body : bodies_->at(link))
    bodies.push_back(makeBody(shrunken(body.shape, depth_m)));
  return bodies;
}

/// With all_voxels every voxel in contact is listed there, forgiven or not; without, the first that is not
/// forgiven ends the search.
std::optional<WorldContact> WorldCollision::linkContact(int link, const std::vector<CollisionBody>& bodies,
                                                        const Eigen::Isometry3d& T_map_link,
                                                        std::vector<std::size_t>* all_voxels) const {
  std::optional<WorldContact> first;
  const auto visit = [&](const CollisionBody& body, const Placement& at, const VoxelIndex& index) {
    if (!meets(body, at, index)) return true;
    const bool inside = grid_->contains(index);
    const WorldContact contact{link, index, grid_->at(index), grid_->centerOf(index)};
    if (all_voxels != nullptr) {
      if (!first) first = contact;
      if (inside) all_voxels->push_back(grid_->offset(index));
      return true;
    }
    if (inside && forgiven(link, T_map_link, index)) return true;
    first = contact;
    return false;
  };
  for (const CollisionBody& body : bodies) {
    if (!visitObstacles(body, Placement(T_map_link * body.shape.T_link_shape), visit)) break;
  }
  return first;
}

/// Calls visit for each obstacle voxel in the body's box until it returns false; then returns false too.
/// Where all of the box lies in the grid, whole blocks of voxels that the body does not reach are left out.
template <typename Visit>
bool WorldCollision::visitObstacles(const CollisionBody& body, const Placement& at,
                                    const Visit& visit) const {
  const Eigen::AlignedBox3d box = mapBounds(body.bounds, at.T_map_shape);
  const VoxelIndex low = grid_->indexOf(box.min());
  const VoxelIndex high = grid_->indexOf(box.max());
  const auto visitBox = [&](const VoxelIndex& first, const VoxelIndex& last) {
    for (int x = first.x(); x <= last.x(); ++x) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int z = first.z(); z <= last.z(); ++z) {
          const VoxelIndex index(x, y, z);
          const bool obstacle = grid_->contains(index) ? grid_->at(index) != Voxel::Free : !outside_is_free_;
          if (obstacle && !visit(body, at, index)) return false;
        }
      }
    }
    return true;
  };
  if (!blocks_ || !grid_->contains(low) || !grid_->contains(high)) return visitBox(low, high);
  return blocks_->visitBlocked(low, high, [&](const VoxelIndex& first, const VoxelIndex& last) {
    const Eigen::Vector3d p_first = grid_->centerOf(first);
    const Eigen::Vector3d p_last = grid_->centerOf(last);
    const Eigen::Vector3d half = (0.5 * (p_last - p_first)).array() + 0.5 * grid_->resolution();
    return quickTouch(body, at, 0.5 * (p_first + p_last), half) == Touch::No || visitBox(first, last);
  });
}

/// Does the body meet a box of the map's axes, as far as that is cheap to tell? Hulls: their furthest face as
/// separating plane, and its point below the box's middle. Others: the box's inner and outer balls.
WorldCollision::Touch WorldCollision::quickTouch(const CollisionBody& body, const Placement& at,
                                                 const Eigen::Vector3d& p_map,
                                                 const Eigen::Vector3d& half_edges) {
  const Eigen::Vector3d p_shape = at.T_shape_map * p_map;
  if (!body.faces) {
    if (!fv_robot_model::isWithin(body.shape, p_shape, half_edges.norm())) return Touch::No;
    return fv_robot_model::isWithin(body.shape, p_shape, half_edges.minCoeff()) ? Touch::Yes : Touch::Unsure;
  }
  const Eigen::Vector3d beside = (p_shape - body.bounds.center()).cwiseAbs() - 0.5 * body.bounds.sizes();
  if (beside.maxCoeff() > half_edges.norm()) return Touch::No;
  const auto [height, normal] = body.faces->furthest(p_shape);
  if (height <= 0.0) return Touch::Yes;
  if (height > half_edges.dot((at.T_map_shape.linear() * normal).cwiseAbs())) return Touch::No;
  const bool near = height <= half_edges.minCoeff();
  return near && body.faces->furthest(p_shape - height * normal).height <= 0.0 ? Touch::Yes : Touch::Unsure;
}

bool WorldCollision::meets(const CollisionBody& body, const Placement& at, const VoxelIndex& index) const {
  const Eigen::Vector3d center = grid_->centerOf(index);
  const Touch touch = quickTouch(body, at, center, Eigen::Vector3d::Constant(0.5 * grid_->resolution()));
  if (touch != Touch::Unsure) return touch == Touch::Yes;
  Eigen::Isometry3d T_map_voxel = Eigen::Isometry3d::Identity();
  T_map_voxel.translation() = center;
  fcl::CollisionRequestd request;
  fcl::CollisionResultd result;
  return fcl::collide(body.geometry.get(), at.T_map_shape, voxel_box_.get(), T_map_voxel, request, result) >
         0;
}

bool WorldCollision::forgiven(int link, const Eigen::Isometry3d& T_map_link, const VoxelIndex& index) const {
  const auto found = allowance_.links.find(link);
  if (found == allowance_.links.end()) return false;
  if (found->second.voxels.count(grid_->offset(index)) == 0) return false;
  for (const CollisionBody& body : found->second.bodies) {
    if (meets(body, Placement(T_map_link * body.shape.T_link_shape), index)) return false;
  }
  return true;
}

}  // namespace ompl_planner
