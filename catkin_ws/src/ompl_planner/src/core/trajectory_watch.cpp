#include "trajectory_watch.h"

#include <algorithm>
#include <stdexcept>

#include "request_check.h"
#include "state_checker.h"
#include "world_collision.h"

namespace ompl_planner {
namespace {

using fv_robot_model::Group;
using fv_robot_model::RobotModel;

/// Links below any of the joints.
std::vector<int> movedLinks(const RobotModel& model, const std::vector<int>& joint_indices) {
  std::vector<int> moved;
  std::vector<bool> is_moved(model.linkNames().size(), false);
  for (std::size_t i = 0; i < is_moved.size(); ++i) {
    const auto& link = model.link(static_cast<int>(i));
    const bool by_joint =
        std::find(joint_indices.begin(), joint_indices.end(), link.variable) != joint_indices.end();
    is_moved[i] = (link.variable >= 0 && by_joint) ||
                  (link.parent >= 0 && is_moved[static_cast<std::size_t>(link.parent)]);
    if (is_moved[i]) moved.push_back(static_cast<int>(i));
  }
  return moved;
}

}  // namespace

Group groupOfJoints(const RobotModel& model, const std::vector<std::string>& joints) {
  checkNamedOnce(joints, "the trajectory");
  for (const std::string& name : model.groupNames()) {
    if (model.group(name).joint_names == joints) return model.group(name);
  }
  Group group;
  group.joint_names = joints;
  for (const std::string& joint : joints) group.joint_indices.push_back(model.jointIndex(joint));
  group.moved_links = movedLinks(model, group.joint_indices);
  return group;
}

VoxelGrid changedObstacles(const VoxelGrid& older, const VoxelGrid& newer) {
  VoxelGrid obstacles = newer;
  const auto changed = newer.changedSince(older);
  for (std::size_t i = 0; i < obstacles.count(); ++i) obstacles.setOffset(i, Voxel::Free);
  for (const std::size_t i : changed) obstacles.setOffset(i, newer.atOffset(i));
  return obstacles;
}

std::string obstacleOnTheWay(const RobotModel& model, const Group& group, const Eigen::VectorXd& q_all,
                             const Eigen::Isometry3d& T_map_root, std::shared_ptr<const VoxelGrid> obstacles,
                             const PlannerConfig& config, const TimedTrajectory& trajectory, double from_s) {
  if (trajectory.times.empty()) return {};
  Eigen::VectorXd q = q_all;
  model.setGroup(group, interpolate(trajectory, from_s).q, q);
  const auto poses = model.forward(q);
  auto world = std::make_shared<WorldCollision>(paddedBodies(model, group, config.padding_m), T_map_root,
                                                std::move(obstacles), /*outside_is_free=*/true);
  if (const auto contact = world->allowStart(poses, config.start_tolerance_m))
    return describe(model, *contact);
  const StateChecker checker(model, group, q, world, nullptr, config.joint_step_rad);
  return firstForbidden(trajectory, checker, config.joint_step_rad, from_s);
}

}  // namespace ompl_planner
