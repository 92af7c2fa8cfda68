/// Grids and distance fields, kept between requests as long as the map allows.
#pragma once

#include <fv_robot_model/robot_model.h>

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "distance_field.h"
#include "fast_collision.h"
#include "octree_collision.h"
#include "world_collision.h"

namespace ompl_planner {

/// What the checks of one request stand on.
struct PreparedWorld {
  std::shared_ptr<const VoxelGrid> grid;         ///< Unknown-space policy applied.
  std::shared_ptr<const ObstacleBlocks> blocks;  ///< Of the grid.
  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const LinkCovers> covers;
  std::shared_ptr<const ObstacleOctree> octree;  ///< Only when asked for.
  bool outside_is_free{false};
};

/// Builds prepared worlds and remembers the last few. A memory only: answers are those of a fresh build.
/// Thread-safe.
class WorldMemory {
 public:
  /// @param padding_m Of the links in the search.
  WorldMemory(double field_cap_m, double padding_m, bool with_octree)
      : field_cap_(field_cap_m), padding_(padding_m), with_octree_(with_octree) {}

  PreparedWorld get(const std::shared_ptr<const VoxelGrid>& map, UnknownSpace policy, double bubble_radius_m,
                    const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                    const fv_robot_model::LinkPoses& poses, const Eigen::Isometry3d& T_map_root);

  /// paddedBodies(), made once for each group and padding.
  std::shared_ptr<const LinkBodies> bodies(const fv_robot_model::RobotModel& model,
                                           const fv_robot_model::Group& group, double padding_m);

 private:
  struct Entry {
    std::shared_ptr<const VoxelGrid> map;
    UnknownSpace policy;
    std::string group;
    Eigen::AlignedBox3d region;
    PreparedWorld world;
  };
  const PreparedWorld* find(const Entry& key) const;

  double field_cap_;
  double padding_;
  bool with_octree_;
  std::mutex mutex_;
  std::deque<Entry> entries_;
  std::map<std::string, std::shared_ptr<const LinkCovers>> covers_;
  std::map<std::pair<std::string, double>, std::shared_ptr<const LinkBodies>> bodies_;
};

}  // namespace ompl_planner
