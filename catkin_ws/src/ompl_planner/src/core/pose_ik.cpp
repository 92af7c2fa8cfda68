#include "ompl_planner/pose_ik.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace ompl_planner {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

constexpr int kIterations = 40;
constexpr double kMaxStepRad = 0.5;
constexpr double kWideAngle = 0.1;  // [rad] tolerances above this are room to use

/// Error of a pose: position in the base frame [m], rotation vector in the tool frame [rad]; with free roll
/// without the part about z.
Vector6 poseError(const Eigen::Isometry3d& T_base_tool, const PoseTarget& target) {
  Vector6 error;
  error.head<3>() = target.T_base_tool.translation() - T_base_tool.translation();
  const Eigen::Matrix3d R = T_base_tool.linear().transpose() * target.T_base_tool.linear();
  if (!target.free_roll) {
    const Eigen::AngleAxisd rotation(R);
    error.tail<3>() = rotation.angle() * rotation.axis();
    return error;
  }
  // The shortest rotation that takes z to the wanted z; its axis is perpendicular to z.
  const Eigen::Vector3d z = R.col(2);
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(z);
  const double sine = axis.norm();
  const double angle = std::atan2(sine, z.z());
  error.tail<3>() = sine > 1e-12 ? Eigen::Vector3d(angle / sine * axis) : Eigen::Vector3d(angle, 0.0, 0.0);
  return error;
}

/// What of an error must be worked off: within half of a wide tolerance, nothing.
Vector6 beyondTolerance(Vector6 error, const PoseTarget& target) {
  const double angle = error.tail<3>().norm();
  const double allowed = target.angle_tolerance_rad > kWideAngle ? 0.5 * target.angle_tolerance_rad : 0.0;
  error.tail<3>() *= angle > allowed ? (angle - allowed) / angle : 0.0;
  return error;
}

bool withinTolerance(const Vector6& error, const PoseTarget& target, double share) {
  return error.head<3>().norm() <= share * target.position_tolerance_m &&
         error.tail<3>().norm() <= share * target.angle_tolerance_rad;
}

/// The group's Jacobian for the tool's origin, rotation rows in the tool frame.
Jacobian toolJacobian(Jacobian J, const Eigen::Isometry3d& T_base_tip, const Eigen::Isometry3d& T_base_tool,
                      bool free_roll) {
  const Eigen::Vector3d lever = T_base_tool.translation() - T_base_tip.translation();
  for (Eigen::Index c = 0; c < J.cols(); ++c) {
    const Eigen::Vector3d omega = J.col(c).tail<3>();
    J.col(c).head<3>() += omega.cross(lever);
    J.col(c).tail<3>() = T_base_tool.linear().transpose() * omega;
    if (free_roll) J(5, c) = 0.0;
  }
  return J;
}

}  // namespace

bool reaches(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
             const PoseTarget& target, const JointVector& q) {
  return withinTolerance(poseError(model.tipPose(group, q) * target.T_tip_tool, target), target, 1.0 + 1e-9);
}

NumericIk::NumericIk(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group)
    : model_(model), group_(group), lower_(group.joint_indices.size()), upper_(group.joint_indices.size()) {
  if (!group.isChain())
    throw std::invalid_argument("group '" + group.name + "' is no chain: no poses for it");
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
    const auto& limits = model.limits()[static_cast<std::size_t>(group.joint_indices[i])];
    lower_[static_cast<Eigen::Index>(i)] = limits.bounded ? limits.lower : -kInfinity;
    upper_[static_cast<Eigen::Index>(i)] = limits.bounded ? limits.upper : kInfinity;
  }
}

JointVector NumericIk::clamped(const JointVector& q) const { return q.cwiseMax(lower_).cwiseMin(upper_); }

std::optional<JointVector> NumericIk::solve(const PoseTarget& target, const JointVector& seed) const {
  JointVector q = clamped(seed);
  double best = std::numeric_limits<double>::infinity();
  int stalled = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Eigen::Isometry3d T_base_tip = model_.tipPose(group_, q);
    const Eigen::Isometry3d T_base_tool = T_base_tip * target.T_tip_tool;
    const Vector6 error = beyondTolerance(poseError(T_base_tool, target), target);
    if (withinTolerance(error, target, 0.1))
      return q;  // tighter than asked: tolerances are not a place to aim at
    const double norm = error.norm();
    stalled = norm < 0.99 * best ? 0 : stalled + 1;
    best = std::min(best, norm);
    if (stalled > 4) break;
    Jacobian J = toolJacobian(model_.jacobian(group_, q), T_base_tip, T_base_tool, target.free_roll);
    if (error.tail<3>().isZero(0.0)) J.bottomRows<3>().setZero();
    const double damping = 1e-4 + 1e-2 * error.squaredNorm();
    const Matrix6 A = J * J.transpose() + damping * Matrix6::Identity();
    JointVector step = J.transpose() * A.ldlt().solve(error);
    const double largest = step.cwiseAbs().maxCoeff();
    if (largest > kMaxStepRad) step *= kMaxStepRad / largest;
    q = clamped(q + step);
  }
  return reaches(model_, group_, target, q) ? std::optional<JointVector>(q) : std::nullopt;
}

}  // namespace ompl_planner
