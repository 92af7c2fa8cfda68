/// The judge: do the links meet voxels that are not free? Exact shapes, FCL's narrow phase.
#pragma once

#include <fcl/geometry/collision_geometry.h>
#include <fv_robot_model/robot_model.h>

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "hull_faces.h"
#include "obstacle_blocks.h"
#include "ompl_planner/voxel_grid.h"

namespace ompl_planner {

/// A link in a voxel.
struct WorldContact {
  int link;               ///< Index in the robot model.
  VoxelIndex voxel;       ///< In the map frame.
  Voxel kind;             ///< Occupied or Unknown.
  Eigen::Vector3d p_map;  ///< Centre of the voxel [m].
};

/// "link 'right_palm' meets the occupied voxel at (0.51, 0.03, 1.25)"
std::string describe(const fv_robot_model::RobotModel& model, const WorldContact& contact);

/// The grid in which Free means: links may go there. Unknown voxels become Free where `policy` says so.
/// @param start_poses, T_map_root, bubble_radius_m Used for FreeNearStart: voxels whose centres lie within
/// the radius of
///   a link that the group moves.
VoxelGrid applyPolicy(const VoxelGrid& map, UnknownSpace policy, const fv_robot_model::RobotModel& model,
                      const fv_robot_model::Group& group, const fv_robot_model::LinkPoses& start_poses,
                      const Eigen::Isometry3d& T_map_root, double bubble_radius_m);

/// One shape of a link, ready for FCL.
struct CollisionBody {
  fv_robot_model::Shape shape;
  std::shared_ptr<const fcl::CollisionGeometryd> geometry;
  Eigen::AlignedBox3d bounds;                ///< Shape frame [m].
  std::shared_ptr<const HullFaces> faces{};  ///< Of a hull that is asked often; else null.
};

/// Links that a group moves, with their shapes padded; those without shapes are left out.
using LinkBodies = std::map<int, std::vector<CollisionBody>>;
std::shared_ptr<const LinkBodies> paddedBodies(const fv_robot_model::RobotModel& model,
                                               const fv_robot_model::Group& group, double padding_m);

/// A shape of the same kind whose surface lies depth_m deeper; at least a tenth of the shape remains.
fv_robot_model::Shape shrunken(const fv_robot_model::Shape& shape, double depth_m);

/// What of the start's contacts is forgiven: each link may stay in the voxels that it meets at the start, no
/// deeper than there. Voxel edges and the self-filter's padding make such contacts; nothing else may pass
/// through them.
struct StartAllowance {
  struct Link {
    std::set<std::size_t> voxels;       ///< Offsets in the grid.
    double depth_m{0.0};                ///< How far the padded link reaches into them.
    std::vector<CollisionBody> bodies;  ///< The link's shapes, that much smaller.
  };
  std::map<int, Link> links;
};

/// Checks the links that a group moves against a grid. Immutable after construction; one per request.
class WorldCollision {
 public:
  /// @param grid      Every voxel but the Free ones is an obstacle; outside of it, everything is unless
  ///                  outside_is_free.
  /// @param bodies    Links and their padded shapes; making them takes long for hulls of many faces.
  /// @param blocks    Of the grid; may be null: slower, with the same answers.
  WorldCollision(std::shared_ptr<const LinkBodies> bodies, const Eigen::Isometry3d& T_map_root,
                 std::shared_ptr<const VoxelGrid> grid, bool outside_is_free,
                 std::shared_ptr<const ObstacleBlocks> blocks = nullptr);

  /// The first contact in the order of the links; empty when all are free.
  std::optional<WorldContact> firstContact(const fv_robot_model::LinkPoses& poses) const;
  bool inContact(const fv_robot_model::LinkPoses& poses) const { return firstContact(poses).has_value(); }
  /// The first contact of one link that the group moves.
  std::optional<WorldContact> contactOf(const fv_robot_model::LinkPoses& poses, int link) const;
  bool hasAllowance(int link) const { return allowance_.links.count(link) != 0; }

  /// Forgives contacts of the start up to max_depth_m (of the padded links).
  /// @return A contact that is deeper: then nothing is forgiven and the start is in collision.
  std::optional<WorldContact> allowStart(const fv_robot_model::LinkPoses& poses, double max_depth_m);
  const StartAllowance& allowance() const { return allowance_; }

  /// The first contact of one link with its shapes shrunk by depth_m; the allowance is not asked.
  std::optional<WorldContact> contactAtDepth(const fv_robot_model::LinkPoses& poses, int link,
                                             double depth_m) const;

 private:
  struct Placement {
    explicit Placement(const Eigen::Isometry3d& T) : T_map_shape(T), T_shape_map(T.inverse()) {}
    Eigen::Isometry3d T_map_shape;
    Eigen::Isometry3d T_shape_map;
  };
  template <typename Visit>
  bool visitObstacles(const CollisionBody& body, const Placement& at, const Visit& visit) const;
  std::optional<WorldContact> linkContact(int link, const std::vector<CollisionBody>& bodies,
                                          const Eigen::Isometry3d& T_map_link,
                                          std::vector<std::size_t>* all_voxels) const;
  enum class Touch { No, Yes, Unsure };
  static Touch quickTouch(const CollisionBody& body, const Placement& at, const Eigen::Vector3d& p_map,
                          const Eigen::Vector3d& half_edges);
  bool meets(const CollisionBody& body, const Placement& at, const VoxelIndex& index) const;
  bool forgiven(int link, const Eigen::Isometry3d& T_map_link, const VoxelIndex& index) const;
  std::vector<CollisionBody> shrunkenBodies(int link, double depth_m) const;

  Eigen::Isometry3d T_map_root_;
  std::shared_ptr<const VoxelGrid> grid_;
  std::shared_ptr<const ObstacleBlocks> blocks_;
  bool outside_is_free_;
  std::shared_ptr<const LinkBodies> bodies_;
  std::shared_ptr<const fcl::CollisionGeometryd> voxel_box_;
  StartAllowance allowance_;
};

}  // namespace ompl_planner
