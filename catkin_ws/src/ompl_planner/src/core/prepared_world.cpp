#include "prepared_world.h"

#include "reach.h"

namespace ompl_planner {
namespace {

using fv_robot_model::Group;
using fv_robot_model::RobotModel;

constexpr std::size_t kKeptWorlds = 3;

}  // namespace

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
