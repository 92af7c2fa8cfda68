/// Inverse kinematics of one pose: the interface that goal sampling uses, and a numeric solver for any chain.
#pragma once

#include <fv_robot_model/robot_model.h>

#include <optional>

#include "ompl_planner/blended_path.h"

namespace ompl_planner {

/// What a joint state must satisfy to count as reaching a pose.
struct PoseTarget {
  Eigen::Isometry3d T_base_tool{Eigen::Isometry3d::Identity()};  ///< Wanted pose in the group's base frame.
  Eigen::Isometry3d T_tip_tool{Eigen::Isometry3d::Identity()};   ///< Tool frame on the group's tip.
  bool free_roll{false};  ///< Any rotation about the tool's z axis will do.
  double position_tolerance_m{0.005};
  double angle_tolerance_rad{0.02};
};

/// Finds joint states of a group that reach a pose. Solutions lie within the joint limits.
class PoseIk {
 public:
  virtual ~PoseIk() = default;
  /// One solution near `seed`, or nothing when the iteration ends elsewhere. Deterministic.
  virtual std::optional<JointVector> solve(const PoseTarget& target, const JointVector& seed) const = 0;
};

/// Is T_base_tool reached at q?
bool reaches(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
             const PoseTarget& target, const JointVector& q);

/// Damped least squares (Levenberg-Marquardt with Nakamura's damping) on the group's Jacobian. With free roll
/// the rotation about the tool's z axis is left out of the error: one more degree of redundancy, not a
/// sample.
class NumericIk : public PoseIk {
 public:
  /// @throws std::invalid_argument when the group is no chain.
  NumericIk(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group);
  std::optional<JointVector> solve(const PoseTarget& target, const JointVector& seed) const override;

 private:
  JointVector clamped(const JointVector& q) const;

  const fv_robot_model::RobotModel& model_;
  const fv_robot_model::Group& group_;
  JointVector lower_;
  JointVector upper_;
};

}  // namespace ompl_planner
