/// The search's check of links against the map: spheres in a distance field, the judge where they cannot
/// tell.
#pragma once

#include <fv_robot_model/robot_model.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "distance_field.h"
#include "world_collision.h"

namespace ompl_planner {

/// Do the links that a group moves meet obstacles?
class WorldCheck {
 public:
  virtual ~WorldCheck() = default;
  virtual bool inContact(const fv_robot_model::LinkPoses& poses) const = 0;
};

/// How links are covered by balls.
struct CoverOptions {
  double max_radius_m{0.06};   ///< Largest ball of a check's cover [m]: few balls, the judge is quick too.
  double fine_radius_m{0.04};  ///< Largest ball where distances are asked for [m]: small ones hug the shape.
};

/// Balls that contain the padded links, once per robot and group. The padded shapes themselves are covered:
/// their sharp corners reach further than balls of the bare shapes that grow by the padding.
class LinkCovers {
 public:
  /// @throws std::invalid_argument when more than 256 links have shapes.
  LinkCovers(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group, double padding_m,
             const CoverOptions& options = {});
  double padding() const { return padding_; }

  struct Ball {
    Eigen::Vector3d center;  ///< Link frame [m].
    double radius;
    bool inside;  ///< The centre lies in the link's own shapes: where it meets an obstacle, the link does.
  };
  struct Link {
    int index;
    Ball whole;               ///< Contains the link.
    std::vector<Ball> balls;  ///< Contain it together.
    std::vector<Ball> fine;   ///< So do these: more of them, closer to its surface.
  };
  const std::vector<Link>& links() const { return links_; }

 private:
  double padding_;
  std::vector<Link> links_;
};

/// Which checks decided, for measurements.
struct FastCounts {
  std::size_t free_by_whole{0};  ///< Links.
  std::size_t free_by_balls{0};
  std::size_t blocked_by_ball{0};
  std::size_t judged{0};
};

/// Same answers as the WorldCollision that it wraps: a link whose balls all keep clear of obstacles is free,
/// a link with a ball's centre inside an obstacle is not, and everything between goes to the judge, link by
/// link.
class FastCollision : public WorldCheck {
 public:
  /// @param judge Its padding must be that of the covers.
  FastCollision(std::shared_ptr<const LinkCovers> covers, std::shared_ptr<const DistanceField> field,
                std::shared_ptr<const WorldCollision> judge, const Eigen::Isometry3d& T_map_root);

  bool inContact(const fv_robot_model::LinkPoses& poses) const override { return inContact(poses, nullptr); }
  bool inContact(const fv_robot_model::LinkPoses& poses, FastCounts* counts) const;

  /// A number not above the distance of the links (without padding) to the obstacles [m], at most `cap_m`.
  double clearance(const fv_robot_model::LinkPoses& poses, double cap_m) const;

  enum class Answer { Free, Blocked, Unsure };
  /// What the balls of one link say.
  Answer ask(const LinkCovers::Link& link, const Eigen::Isometry3d& T_map_link,
             FastCounts* counts = nullptr) const;

  const WorldCollision& judge() const { return *judge_; }

 private:
  std::shared_ptr<const LinkCovers> covers_;
  std::shared_ptr<const DistanceField> field_;
  std::shared_ptr<const WorldCollision> judge_;
  Eigen::Isometry3d T_map_root_;
};

}  // namespace ompl_planner
