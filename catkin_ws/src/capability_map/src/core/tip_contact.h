/// What the tip carries against what the arm does not move: contact that no choice of joints avoids.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "fv_robot_model/robot_model.h"
#include "fv_robot_model/self_collision.h"

namespace capability_map {

/// Once the tip's pose is chosen the hand's is, whatever the joints do; where a last joint is held, so is the
/// link before it. If these touch the robot's resting part, inverse kinematics need not be asked. Keeps
/// buffers: one object per thread.
class TipContact {
 public:
  /// @param q_rest All joints of the model, those outside the group as they rest. @param last_held Values at
  /// which
  ///        the last joint of the group may be held; empty: it never is.
  TipContact(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
             const Eigen::VectorXd& q_rest, const std::vector<double>& last_held);

  /// Does what the tip carries touch the resting part?
  /// @param held Index into last_held; 0 when that is empty.
  bool unavoidable(const fv_robot_model::SelfCollision& collision, const Eigen::Isometry3d& T_base_tip,
                   size_t held);

  /// Number of links that go with the tip.
  size_t carriedLinks() const { return carried_.size(); }

 private:
  Eigen::Isometry3d T_root_base_;
  std::vector<int> carried_;
  /// One row per held value: T_tip_link of the carried links.
  std::vector<std::vector<Eigen::Isometry3d>> T_tip_carried_;
  /// The resting links in place, all others far away from everything.
  fv_robot_model::LinkPoses poses_;
};

}  // namespace capability_map
