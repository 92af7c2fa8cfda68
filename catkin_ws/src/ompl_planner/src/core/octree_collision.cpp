#include "octree_collision.h"

#include <fcl/geometry/octree/octree.h>
#include <fcl/narrowphase/collision.h>
#include <fv_robot_model/fcl_geometry.h>
#include <octomap/OcTree.h>

#include <utility>

namespace ompl_planner {
namespace {

std::shared_ptr<octomap::OcTree> obstacleTree(const VoxelGrid& grid, const Eigen::AlignedBox3d& region) {
  constexpr int kKeyOffset = 32768;
  auto tree = std::make_shared<octomap::OcTree>(grid.resolution());
  const VoxelIndex low = grid.indexOf(region.min()).cwiseMax(grid.origin());
  const VoxelIndex high =
      grid.indexOf(region.max()).cwiseMin(grid.origin() + grid.size() - VoxelIndex::Ones());
  const auto key = [](int index) { return static_cast<octomap::key_type>(index + kKeyOffset); };
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int z = low.z(); z <= high.z(); ++z) {
        if (grid.at({x, y, z}) == Voxel::Free) continue;
        tree->setNodeValue(octomap::OcTreeKey(key(x), key(y), key(z)), tree->getClampingThresMaxLog(), true);
      }
    }
  }
  if (tree->getRoot() != nullptr) tree->updateInnerOccupancy();
  tree->prune();
  return tree;
}

}  // namespace

ObstacleOctree::ObstacleOctree(const VoxelGrid& grid, const Eigen::AlignedBox3d& region_m)
    : geometry_(std::make_shared<fcl::OcTreed>(
          std::shared_ptr<const octomap::OcTree>(obstacleTree(grid, region_m)))) {}

ObstacleOctree::~ObstacleOctree() = default;

OctreeCollision::OctreeCollision(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                                 const Eigen::Isometry3d& T_map_root,
                                 std::shared_ptr<const ObstacleOctree> octree,
                                 std::shared_ptr<const WorldCollision> judge, double padding_m)
    : T_map_root_(T_map_root), octree_(std::move(octree)), judge_(std::move(judge)) {
  for (const int index : group.moved_links) {
    Link link{index, {}};
    for (const auto& shape : model.shapes(index)) {
      const auto grown = padding_m > 0.0 ? fv_robot_model::padded(shape, padding_m) : shape;
      link.bodies.push_back({grown, fv_robot_model::fclGeometry(grown), {}});
    }
    if (!link.bodies.empty()) links_.push_back(std::move(link));
  }
}

bool OctreeCollision::inContact(const fv_robot_model::LinkPoses& poses) const {
  const fcl::CollisionRequestd request;
  for (const Link& link : links_) {
    const Eigen::Isometry3d T_map_link = T_map_root_ * poses[static_cast<std::size_t>(link.index)];
    for (const CollisionBody& body : link.bodies) {
      fcl::CollisionResultd result;
      const Eigen::Isometry3d T_map_shape = T_map_link * body.shape.T_link_shape;
      if (fcl::collide(body.geometry.get(), T_map_shape, &octree_->geometry(), Eigen::Isometry3d::Identity(),
                       request, result) == 0) {
        continue;
      }
      if (!judge_->hasAllowance(link.index) || judge_->contactOf(poses, link.index)) return true;
    }
  }
  return false;
}

}  // namespace ompl_planner
