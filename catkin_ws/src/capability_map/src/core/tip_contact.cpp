#include "tip_contact.h"

#include <random>

namespace capability_map {

using fv_robot_model::LinkPoses;

namespace {

constexpr int kSamples = 4;   // configurations that tell which links move against which
constexpr double kFar = 1e4;  // [m] from one link to the next

bool samePose(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff() < 1e-9;
}

}  // namespace

TipContact::TipContact(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                       const Eigen::VectorXd& q_rest, const std::vector<double>& last_held) {
  const int tip = model.linkIndex(group.tip_link);
  const size_t links = model.linkNames().size();
  Eigen::VectorXd q = q_rest;
  std::mt19937_64 random(1);
  std::vector<bool> resting(links, true), carried(links, true);
  const auto sample = [&](double last) {
    for (const int joint : group.joint_indices) {
      const auto& limits = model.limits()[static_cast<size_t>(joint)];
      q[joint] =
          limits.lower + (limits.upper - limits.lower) * static_cast<double>(random() >> 11) * 0x1.0p-53;
    }
    if (!last_held.empty()) q[group.joint_indices.back()] = last;
    return model.forward(q);
  };
  const LinkPoses first = sample(last_held.empty() ? 0.0 : last_held[0]);
  const auto onTip = [tip](const LinkPoses& poses, size_t i) {
    return poses[static_cast<size_t>(tip)].inverse() * poses[i];
  };
  for (int k = 1; k < kSamples; ++k) {
    const LinkPoses other = sample(last_held.empty() ? 0.0 : last_held[0]);
    for (size_t i = 0; i < links; ++i) {
      resting[i] = resting[i] && samePose(first[i], other[i]);
      carried[i] = carried[i] && samePose(onTip(first, i), onTip(other, i));
    }
  }
  T_root_base_ = first[static_cast<size_t>(model.linkIndex(group.base_link))];
  poses_ = first;
  for (size_t i = 0; i < links; ++i) {
    if (carried[i]) carried_.push_back(static_cast<int>(i));
    if (!resting[i]) poses_[i].translation().x() = kFar * static_cast<double>(i + 1);
  }
  for (size_t held = 0; held < std::max<size_t>(1, last_held.size()); ++held) {
    const LinkPoses there = sample(last_held.empty() ? 0.0 : last_held[held]);
    T_tip_carried_.emplace_back();
    for (const int link : carried_) T_tip_carried_.back().push_back(onTip(there, static_cast<size_t>(link)));
  }
}

bool TipContact::unavoidable(const fv_robot_model::SelfCollision& collision,
                             const Eigen::Isometry3d& T_base_tip, size_t held) {
  const Eigen::Isometry3d T_root_tip = T_root_base_ * T_base_tip;
  for (size_t i = 0; i < carried_.size(); ++i)
    poses_[static_cast<size_t>(carried_[i])] = T_root_tip * T_tip_carried_[held][i];
  return collision.inContact(poses_);
}

}  // namespace capability_map
