/// The plain way: FCL against its own octree. Slow and obvious: the oracle in tests, the reference in
/// benchmarks.
#pragma once

#include <fv_robot_model/robot_model.h>

#include <memory>
#include <vector>

#include "fast_collision.h"
#include "ompl_planner/voxel_grid.h"

namespace ompl_planner {

/// An fcl::OcTree whose occupied nodes are all voxels of a grid that are not Free: since FCL skips absent
/// nodes, unknown voxels are written into it as occupied ones. Immutable.
class ObstacleOctree {
 public:
  ObstacleOctree(const VoxelGrid& grid, const Eigen::AlignedBox3d& region_m);
  ~ObstacleOctree();
  const fcl::CollisionGeometryd& geometry() const { return *geometry_; }

 private:
  std::shared_ptr<const fcl::CollisionGeometryd> geometry_;
};

/// Links against an ObstacleOctree. Where the start has an allowance, the judge decides.
class OctreeCollision : public WorldCheck {
 public:
  /// @param judge Its padding is padding_m.
  OctreeCollision(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                  const Eigen::Isometry3d& T_map_root, std::shared_ptr<const ObstacleOctree> octree,
                  std::shared_ptr<const WorldCollision> judge, double padding_m);
  bool inContact(const fv_robot_model::LinkPoses& poses) const override;

 private:
  struct Link {
    int index;
    std::vector<CollisionBody> bodies;
  };
  Eigen::Isometry3d T_map_root_;
  std::shared_ptr<const ObstacleOctree> octree_;
  std::shared_ptr<const WorldCollision> judge_;
  std::vector<Link> links_;
};

}  // namespace ompl_planner
