#include "pose_target.h"

#include <algorithm>
#include <cmath>

namespace ompl_planner {
namespace {

/// Angle about `axis` that brings R as near as can be to R_near: of R^T R_near the turn about the axis (the
/// swing-twist decomposition of its quaternion).
double nearestRoll(const Eigen::Matrix3d& R, const Eigen::Matrix3d& R_near, const Eigen::Vector3d& axis) {
  const Eigen::Quaterniond difference(R.transpose() * R_near);
  return 2.0 * std::atan2(difference.vec().dot(axis), difference.w());
}

/// Uniform in the unit ball.
Eigen::Vector3d inUnitBall(std::mt19937_64& random) {
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  Eigen::Vector3d p;
  do {
    p = {value(random), value(random), value(random)};
  } while (p.squaredNorm() > 1.0);
  return p;
}

Eigen::Isometry3d toolPoseAt(const PoseTarget& target, const Eigen::Isometry3d& T_base_near,
                             double roll_rad) {
  Eigen::Isometry3d T = target.T_base_tool;
  if (target.free_roll) {
    const double nearest = nearestRoll(T.linear(), T_base_near.linear(), target.roll_axis);
    T.rotate(Eigen::AngleAxisd(nearest + roll_rad, target.roll_axis));
  }
  return T;
}

}  // namespace

Eigen::Isometry3d tipPoseAt(const PoseTarget& target, const Eigen::Isometry3d& T_base_near, double roll_rad) {
  return toolPoseAt(target, T_base_near, roll_rad) * target.T_tip_tool.inverse();
}

Eigen::Isometry3d tipPoseWithin(const PoseTarget& target, const Eigen::Isometry3d& T_base_near,
                                double roll_rad, std::mt19937_64& random) {
  constexpr double kShare = 0.9;  // of the tolerances: the borders are no place to aim at
  Eigen::Isometry3d T = toolPoseAt(target, T_base_near, roll_rad);
  T.translation() += kShare * target.position_tolerance_m * inUnitBall(random);
  const Eigen::Vector3d tilt = kShare * std::min(target.angle_tolerance_rad, M_PI) * inUnitBall(random);
  if (tilt.norm() > 0.0) T.rotate(Eigen::AngleAxisd(tilt.norm(), tilt.normalized()));
  return T * target.T_tip_tool.inverse();
}

}  // namespace ompl_planner
