#include "fast_collision.h"

#include <fv_robot_model/sphere_cover.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace ompl_planner {
namespace {

using fv_robot_model::RobotModel;
using fv_robot_model::Shape;

constexpr std::size_t kMaxLinks = 256;

/// Ball around all balls, centred in their box.
LinkCovers::Ball enclosing(const std::vector<LinkCovers::Ball>& balls) {
  Eigen::AlignedBox3d box;
  for (const auto& ball : balls) box.extend(ball.center);
  LinkCovers::Ball whole{box.center(), 0.0, false};
  for (const auto& ball : balls) {
    whole.radius = std::max(whole.radius, (ball.center - whole.center).norm() + ball.radius);
  }
  return whole;
}

bool insideShapes(const RobotModel& model, int link, const Eigen::Vector3d& p_link) {
  const auto& shapes = model.shapes(link);
  return std::any_of(shapes.begin(), shapes.end(), [&](const Shape& shape) {
    return fv_robot_model::isWithin(shape, shape.T_link_shape.inverse() * p_link, 0.0);
  });
}

}  // namespace

LinkCovers::LinkCovers(const RobotModel& model, const fv_robot_model::Group& group, double padding_m,
                       const CoverOptions& options)
    : padding_(padding_m) {
  for (const int index : group.moved_links) {
    if (model.shapes(index).empty()) continue;
    Link link{index, {}, {}, {}};
    for (const Shape& shape : model.shapes(index)) {
      const Shape grown = padding_m > 0.0 ? fv_robot_model::padded(shape, padding_m) : shape;
      for (const auto& sphere : fv_robot_model::sphereCover(grown, options.max_radius_m)) {
        link.balls.push_back({sphere.center, sphere.radius, insideShapes(model, index, sphere.center)});
      }
      for (const auto& sphere : fv_robot_model::sphereCover(grown, options.fine_radius_m)) {
        link.fine.push_back({sphere.center, sphere.radius, false});
      }
    }
    link.whole = enclosing(link.balls);
    links_.push_back(std::move(link));
  }
  if (links_.size() > kMaxLinks)
    throw std::invalid_argument("more than 256 links with shapes move with one group");
}

FastCollision::FastCollision(std::shared_ptr<const LinkCovers> covers,
                             std::shared_ptr<const DistanceField> field,
                             std::shared_ptr<const WorldCollision> judge, const Eigen::Isometry3d& T_map_root)
    : covers_(std::move(covers)),
      field_(std::move(field)),
      judge_(std::move(judge)),
      T_map_root_(T_map_root) {}

FastCollision::Answer FastCollision::ask(const LinkCovers::Link& link, const Eigen::Isometry3d& T_map_link,
                                         FastCounts* counts) const {
  if (field_->lowerBound(T_map_link * link.whole.center) > link.whole.radius) {
    if (counts != nullptr) ++counts->free_by_whole;
    return Answer::Free;
  }
  bool unsure = false;
  const bool may_refuse = !judge_->hasAllowance(link.index);
  for (const auto& ball : link.balls) {
    const Eigen::Vector3d center = T_map_link * ball.center;
    if (field_->lowerBound(center) > ball.radius) continue;
    if (!may_refuse) return Answer::Unsure;
    if (ball.inside && field_->inObstacle(center)) {
      if (counts != nullptr) ++counts->blocked_by_ball;
      return Answer::Blocked;
    }
    unsure = true;
  }
  if (!unsure && counts != nullptr) ++counts->free_by_balls;
  return unsure ? Answer::Unsure : Answer::Free;
}

bool FastCollision::inContact(const fv_robot_model::LinkPoses& poses, FastCounts* counts) const {
  // All links are asked before any goes to the judge: a cheap refusal of a later one saves that.
  std::array<std::size_t, kMaxLinks> unsure{};
  std::size_t unsure_count = 0;
  const auto& links = covers_->links();
  for (std::size_t i = 0; i < links.size(); ++i) {
    const Answer answer =
        ask(links[i], T_map_root_ * poses[static_cast<std::size_t>(links[i].index)], counts);
    if (answer == Answer::Blocked) return true;
    if (answer == Answer::Unsure) unsure[unsure_count++] = i;
  }
  for (std::size_t k = 0; k < unsure_count; ++k) {
    if (counts != nullptr) ++counts->judged;
    if (judge_->contactOf(poses, links[unsure[k]].index)) return true;
  }
  return false;
}

double FastCollision::clearance(const fv_robot_model::LinkPoses& poses, double cap_m) const {
  double least = cap_m - covers_->padding();  // of the padded links: the bare ones are that much further away
  for (const auto& link : covers_->links()) {
    const Eigen::Isometry3d T_map_link = T_map_root_ * poses[static_cast<std::size_t>(link.index)];
    if (field_->lowerBound(T_map_link * link.whole.center) - link.whole.radius >= least) continue;
    for (const auto& ball : link.fine) {
      least = std::min(least, field_->lowerBound(T_map_link * ball.center) - ball.radius);
    }
  }
  return std::max(0.0, least + covers_->padding());
}

}  // namespace ompl_planner
