#include "reach.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace ompl_planner {
namespace {

using fv_robot_model::Group;
using fv_robot_model::RobotModel;
using Motion = RobotModel::Link::Motion;

constexpr double kMargin = 0.08;       // [m] paddings, and voxels that the region's border cuts
constexpr double kRobotMargin = 0.18;  // [m] so that each group's reach lies within the robot's

/// Where the origin of a link may be, map frame [m]: in the box, or up to `spread` beside it.
struct Whereabouts {
  Eigen::AlignedBox3d box;
  double spread{0.0};
  std::optional<Eigen::Matrix3d> R_map_link;  ///< As long as no joint before has turned.

  explicit Whereabouts(const Eigen::Isometry3d& T_map_link)
      : box(T_map_link.translation(), T_map_link.translation()), R_map_link(T_map_link.linear()) {}

  Eigen::AlignedBox3d grown(double more) const {
    const Eigen::Vector3d all = Eigen::Vector3d::Constant(spread + more);
    return {box.min() - all, box.max() + all};
  }
};

/// Least and largest way of a sliding joint along its axis [m].
std::pair<double, double> strokes(const RobotModel& model, const RobotModel::Link& link) {
  const auto& range = model.limits()[static_cast<std::size_t>(link.variable)];
  return std::minmax(
      {link.multiplier * range.lower + link.offset, link.multiplier * range.upper + link.offset});
}

/// Sliding joints whose direction is known stretch the box along it: a flying camera's three make the box of
/// its room, not a ball about all of their strokes.
Whereabouts childOf(Whereabouts at, const RobotModel& model, const RobotModel::Link& link) {
  const bool slides = link.motion == Motion::Translation;
  const auto [low, high] = slides ? strokes(model, link) : std::make_pair(0.0, 0.0);
  if (!at.R_map_link) {
    at.spread += link.T_parent_joint.translation().norm() + std::max(std::abs(low), std::abs(high));
    return at;
  }
  at.box.translate(*at.R_map_link * link.T_parent_joint.translation());
  at.R_map_link = *at.R_map_link * link.T_parent_joint.linear();
  const Eigen::Vector3d axis = *at.R_map_link * link.axis;
  at.box = Eigen::AlignedBox3d(at.box.min() + (low * axis).cwiseMin(high * axis),
                               at.box.max() + (low * axis).cwiseMax(high * axis));
  if (link.motion == Motion::Rotation) at.R_map_link.reset();
  return at;
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
  Eigen::AlignedBox3d reach;
  std::map<int, Whereabouts> moved;
  for (const int index : group.moved_links) {  // parents first
    const auto& link = model.link(index);
    const auto parent = moved.find(link.parent);
    const Eigen::Isometry3d T_root_parent =
        link.parent >= 0 ? poses[static_cast<std::size_t>(link.parent)] : Eigen::Isometry3d::Identity();
    const Whereabouts at = childOf(
        parent == moved.end() ? Whereabouts(T_map_root * T_root_parent) : parent->second, model, link);
    reach.extend(at.grown(shapeReach(model, index) + kMargin));
    moved.emplace(index, at);
  }
  return reach;
}

Eigen::AlignedBox3d robotReach(const RobotModel& model, const Eigen::Isometry3d& T_map_root) {
  Eigen::AlignedBox3d reach;
  std::vector<Whereabouts> links;
  for (int index = 0; index < static_cast<int>(model.linkNames().size()); ++index) {  // parents first
    const auto& link = model.link(index);
    links.push_back(link.parent < 0 ? Whereabouts(T_map_root)
                                    : childOf(links[static_cast<std::size_t>(link.parent)], model, link));
    reach.extend(links.back().grown(shapeReach(model, index) + kRobotMargin));
  }
  return reach;
}

}  // namespace ompl_planner
