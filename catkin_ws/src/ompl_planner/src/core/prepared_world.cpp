#include "ompl_planner/prepared_world.h"

#include <algorithm>
#include <cmath>

namespace ompl_planner {
namespace {

using fv_robot_model::Group;
using fv_robot_model::RobotModel;

constexpr std::size_t kKeptWorlds = 3;
constexpr double kMargin = 0.08;  // [m] paddings, and voxels that the region's border cuts

/// How far a joint can push its link along its axis [m].
double stroke(const RobotModel& model, const RobotModel::Link& link) {
  if (link.motion != RobotModel::Link::Motion::Translation) return 0.0;
  const auto& range = model.limits()[static_cast<std::size_t>(link.variable)];
  return std::abs(link.multiplier) * std::max(std::abs(range.lower), std::abs(range.upper)) +
         std::abs(link.offset);
}

double shapeReach(const RobotModel& model, int link) {
  double reach = 0.0;
  for (const auto& shape : model.shapes(link)) {
    const auto ball = fv_robot_model::boundingSphere(shape);
    reach = std::max(reach, ball.center.norm() + ball.radius);
  }
  return reach;
}

}  // namespace

Eigen::AlignedBox3d groupReach(const RobotModel& model, const Group& group,
                               const fv_robot_model::LinkPoses& poses, const Eigen::Isometry3d& T_map_root) {
  Eigen::AlignedBox3d box;
  std::map<int, std::pair<int, double>>
      from_first;  // moved link -> first moved ancestor, largest distance from its joint
  for (const int index : group.moved_links) {
    const auto& link = model.link(index);
    const auto parent = from_first.find(link.parent);
    from_first[index] =
        parent == from_first.end()
            ? std::make_pair(index, stroke(model, link))
            : std::make_pair(parent->second.first, parent->second.second + stroke(model, link) +
                                                       link.T_parent_joint.translation().norm());
    const auto& [first, distance] = from_first[index];
    const auto& joint = model.link(first);
    const Eigen::Isometry3d T_root_joint =
        (joint.parent >= 0 ? poses[static_cast<std::size_t>(joint.parent)] : Eigen::Isometry3d::Identity()) *
        joint.T_parent_joint;
    const Eigen::Vector3d center = T_map_root * T_root_joint.translation();
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(distance + shapeReach(model, index) + kMargin);
    box.extend(Eigen::AlignedBox3d(center - half, center + half));
  }
  return box;
}

Eigen::AlignedBox3d robotReach(const RobotModel& model, const Eigen::Isometry3d& T_map_root) {
  std::vector<double> distance(model.linkNames().size(), 0.0);  // of a link's origin from the root's, at most
  double reach = 0.0;
  for (std::size_t i = 0; i < distance.size(); ++i) {
    const auto& link = model.link(static_cast<int>(i));
    if (link.parent >= 0) {
      distance[i] = distance[static_cast<std::size_t>(link.parent)] +
                    link.T_parent_joint.translation().norm() + stroke(model, link);
    }
    if (!model.shapes(static_cast<int>(i)).empty()) {
      reach = std::max(reach, distance[i] + shapeReach(model, static_cast<int>(i)));
    }
  }
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(reach + kMargin + 0.1);
  return {T_map_root.translation() - half, T_map_root.translation() + half};
}

std::shared_ptr<const LinkBodies> WorldMemory::bodies(const RobotModel& model, const Group& group,
                                                      double padding_m) {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto& bodies = bodies_[{group.name, padding_m}];
  if (!bodies) bodies = paddedBodies(model, group, padding_m);
  return bodies;
}

const PreparedWorld* WorldMemory::find(const Entry& key) const {
  for (const Entry& entry : entries_) {
    if (entry.map == key.map && entry.policy == key.policy && entry.group == key.group &&
        entry.region.isApprox(key.region, 1e-9)) {
      return &entry.world;
    }
  }
  return nullptr;
}

PreparedWorld WorldMemory::get(const std::shared_ptr<const VoxelGrid>& map, UnknownSpace policy,
                               double bubble_radius_m, const RobotModel& model, const Group& group,
                               const fv_robot_model::LinkPoses& poses, const Eigen::Isometry3d& T_map_root) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Entry entry{map, policy, group.name, groupReach(model, group, poses, T_map_root), {}};
  const bool lasting = policy != UnknownSpace::FreeNearStart;  // a bubble belongs to one start
  if (lasting) {
    if (const PreparedWorld* known = find(entry)) return *known;
  }
  auto& covers = covers_[group.name];
  if (!covers) covers = std::make_shared<LinkCovers>(model, group, padding_);
  entry.world.covers = covers;
  entry.world.outside_is_free = policy == UnknownSpace::Free;
  entry.world.grid = policy == UnknownSpace::Obstacle
                         ? map
                         : std::make_shared<VoxelGrid>(
                               applyPolicy(*map, policy, model, group, poses, T_map_root, bubble_radius_m));
  entry.world.blocks = std::make_shared<ObstacleBlocks>(*entry.world.grid);
  entry.world.field = std::make_shared<DistanceField>(*entry.world.grid, entry.region, field_cap_);
  if (with_octree_) entry.world.octree = std::make_shared<ObstacleOctree>(*entry.world.grid, entry.region);
  if (lasting) {
    entries_.push_back(entry);
    if (entries_.size() > kKeptWorlds) entries_.pop_front();
  }
  return entry.world;
}

}  // namespace ompl_planner
