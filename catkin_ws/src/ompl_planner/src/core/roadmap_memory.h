/// Roadmaps that outlive a query, as long as the map allows.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "ompl_planner/voxel_grid.h"
#include "path_search.h"
#include "world_collision.h"

namespace ompl_planner {

/// What a roadmap's edges were checked against.
struct RoadmapScope {
  std::string group;
  UnknownSpace policy{UnknownSpace::Obstacle};
  Eigen::VectorXd others;  ///< All joints; those of the group at 0 [rad].
  Eigen::Isometry3d T_map_root{Eigen::Isometry3d::Identity()};
  std::shared_ptr<const VoxelGrid> grid;  ///< The map, before the policy.
};

/// Are all voxels that are free for the policy in `older` free in `newer` too? False when they do not cover
/// the same voxels.
bool onlyFreed(const VoxelGrid& older, const VoxelGrid& newer, UnknownSpace policy);

/// Keeps the roadmaps of PRM and LazyPRM for the queries that follow. Where the map has only become freer a
/// roadmap stays as it is; where new obstacles came, LazyPRM keeps its states and checks them anew, and PRM
/// begins afresh. A start in touch with the map (see WorldCollision::allowStart) may leave edges that later
/// starts must not use: callers check the path and call forget() when it does not stand.
///
/// Answers depend on the queries before: equal requests may give different paths. Not thread-safe.
class RoadmapMemory {
 public:
  RoadmapMemory();
  ~RoadmapMemory();

  /// As ompl_planner::findPath, for planners of which keepsRoadmap is true.
  std::optional<JointPath> findPath(const RoadmapScope& scope, const SearchProblem& problem,
                                    const std::string& planner, std::uint32_t seed,
                                    const std::function<bool()>& stop);

  /// Drops the roadmap of this planner and group.
  void forget(const std::string& planner, const std::string& group);

  /// States of the roadmap that answered last; 0 before.
  std::size_t milestones() const { return milestones_; }

 private:
  struct Entry;
  Entry& entryFor(const RoadmapScope& scope, const SearchProblem& problem, const std::string& planner,
                  std::uint32_t seed);

  std::deque<std::unique_ptr<Entry>> entries_;  ///< Last used last.
  std::size_t milestones_{0};
};

}  // namespace ompl_planner
