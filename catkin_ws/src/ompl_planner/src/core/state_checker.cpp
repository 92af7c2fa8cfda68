#include "state_checker.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ompl_planner {

StateChecker::StateChecker(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                           const Eigen::VectorXd& q_all, std::shared_ptr<const WorldCollision> world,
                           std::shared_ptr<const fv_robot_model::SelfCollision> self, double joint_step_rad,
                           std::shared_ptr<const WorldCheck> fast)
    : model_(model),
      group_(group),
      world_(std::move(world)),
      self_(std::move(self)),
      joint_step_(joint_step_rad),
      fast_(std::move(fast)),
      q_all_(q_all),
      poses_(model.forward(q_all)) {}

const fv_robot_model::LinkPoses& StateChecker::posesAt(const JointVector& q) const {
  model_.setGroup(group_, q, q_all_);
  model_.forward(q_all_, group_, poses_);
  return poses_;
}

bool StateChecker::valid(const JointVector& q) const {
  ++checks_;
  const auto& poses = posesAt(q);
  if (fast_ ? fast_->inContact(poses) : world_->inContact(poses)) return false;
  return !selfContact(poses);
}

void StateChecker::allowClosePairs(std::shared_ptr<const fv_robot_model::SelfCollision> bare,
                                   const std::vector<fv_robot_model::LinkPair>& pairs) {
  bare_self_ = std::move(bare);
  close_pairs_ = pairs;
}

std::optional<fv_robot_model::LinkPair> StateChecker::selfContact(
    const fv_robot_model::LinkPoses& poses) const {
  if (!self_) return std::nullopt;
  if (close_pairs_.empty()) return self_->firstContact(poses);
  for (const auto& pair : self_->contacts(poses)) {
    if (std::find(close_pairs_.begin(), close_pairs_.end(), pair) == close_pairs_.end()) return pair;
  }
  return bare_self_->firstContact(poses);
}

Blockage StateChecker::blockageAt(const JointVector& q) const {
  using By = Blockage::By;
  const auto& poses = posesAt(q);
  if (const auto contact = world_->firstContact(poses)) {
    return {contact->kind == Voxel::Occupied ? By::Obstacle : By::UnknownSpace, describe(model_, *contact)};
  }
  if (const auto pair = selfContact(poses)) {
    const auto touching = bare_self_ ? bare_self_->contacts(poses) : std::vector{*pair};
    const bool touch = std::find(touching.begin(), touching.end(), *pair) != touching.end();
    return {By::Robot, "links '" + pair->first + "' and '" + pair->second +
                           (touch ? "' touch" : "' come closer to each other than their padding")};
  }
  return {};
}

bool StateChecker::edgeValid(const JointVector& from, const JointVector& to, double joint_step_rad) const {
  const int steps = static_cast<int>(std::ceil(maxJointStep(from, to) / joint_step_rad));
  // Coarse steps first: a blocked edge is mostly found in the middle.
  for (int stride = 16; stride >= 1; stride /= 2) {
    for (int i = stride; i < steps; i += stride) {
      if (stride < 16 && i % (2 * stride) == 0) continue;  // done with the larger stride
      if (!valid(from + (to - from) * (static_cast<double>(i) / steps))) return false;
    }
  }
  return true;
}

std::string firstForbidden(const TimedTrajectory& trajectory, const StateChecker& checker, double step_rad,
                           double from_s) {
  const double duration = trajectory.duration();
  double time = std::min(std::max(from_s, 0.0), duration);
  JointVector last = interpolate(trajectory, time).q;
  if (!checker.valid(last)) return checker.whyInvalid(last) + " after " + std::to_string(time) + " s";
  double delta = 0.01;
  while (time < duration) {
    // As far as the step allows: grow, then cut until it fits.
    delta = std::min({1.3 * delta, 0.05, duration - time});
    JointVector q = interpolate(trajectory, time + delta).q;
    for (double moved = maxJointStep(last, q); moved > step_rad && delta > 1e-6;
         moved = maxJointStep(last, q)) {
      delta *= std::max(0.5, 0.98 * step_rad / moved);
      q = interpolate(trajectory, time + delta).q;
    }
    time = duration - time - delta < 1e-9 ? duration : time + delta;
    if (!checker.valid(q)) return checker.whyInvalid(q) + " after " + std::to_string(time) + " s";
    last = q;
  }
  return {};
}

}  // namespace ompl_planner
