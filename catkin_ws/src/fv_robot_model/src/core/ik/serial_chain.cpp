#include "fv_robot_model/ik/serial_chain.h"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace fv_robot_model::ik {

namespace {

void checkJoint(const ChainJoint& joint) {
  const bool finite = joint.axis.allFinite() && joint.point.allFinite() && std::isfinite(joint.lower) &&
                      std::isfinite(joint.upper);
  if (!finite) {
    throw std::invalid_argument("joint '" + joint.name + "': axis, point and limits must be finite");
  }
  if (std::abs(joint.axis.norm() - 1.0) > 1e-9) {
    throw std::invalid_argument("joint '" + joint.name + "': axis must be a unit vector, its length is " +
                                std::to_string(joint.axis.norm()));
  }
  if (joint.lower > joint.upper) {
    throw std::invalid_argument("joint '" + joint.name + "': lower limit " + std::to_string(joint.lower) +
                                " is above upper limit " + std::to_string(joint.upper));
  }
}

/// Column of an axis that passes through `point` while the tip is at `tip`.
Eigen::Matrix<double, 6, 1> twistAt(const ChainJoint& joint, const Eigen::Vector3d& point,
                                    const Eigen::Vector3d& axis, const Eigen::Vector3d& tip) {
  Eigen::Matrix<double, 6, 1> twist;
  if (joint.prismatic) {
    twist << axis, Eigen::Vector3d::Zero();
  } else {
    twist << axis.cross(tip - point), axis;
  }
  return twist;
}

/// The point of the line (point, axis) for which |x - before| + |x - after| is smallest: unfold the second
/// distance into the plane of the first (the reflection principle).
Eigen::Vector3d shortestVia(const ChainJoint& line, const Eigen::Vector3d& before,
                            const Eigen::Vector3d& after) {
  const double t_before = line.axis.dot(before - line.point);
  const double t_after = line.axis.dot(after - line.point);
  const double d_before = (before - line.point - t_before * line.axis).norm();
  const double d_after = (after - line.point - t_after * line.axis).norm();
  const double sum = d_before + d_after;
  const double weight = sum > 1e-15 ? d_before / sum : 0.5;
  return line.point + ((1.0 - weight) * t_before + weight * t_after) * line.axis;
}

double polylineLength(const std::vector<Eigen::Vector3d>& vertices) {
  double length = 0.0;
  for (size_t i = 1; i < vertices.size(); ++i) length += (vertices[i] - vertices[i - 1]).norm();
  return length;
}

}  // namespace

Eigen::Matrix3d rotationAbout(const Eigen::Vector3d& h, double c, double s) {
  Eigen::Matrix3d R = (1.0 - c) * h * h.transpose();
  R.diagonal().array() += c;
  R(0, 1) -= s * h.z();
  R(0, 2) += s * h.y();
  R(1, 0) += s * h.z();
  R(1, 2) -= s * h.x();
  R(2, 0) -= s * h.y();
  R(2, 1) += s * h.x();
  return R;
}

Eigen::Isometry3d jointMotion(const ChainJoint& joint, double q) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (joint.prismatic) {
    T.translation() = q * joint.axis;
    return T;
  }
  T.linear() = rotationAbout(joint.axis, std::cos(q), std::sin(q));
  T.translation() = joint.point - T.linear() * joint.point;
  return T;
}

SerialChain::SerialChain(std::vector<ChainJoint> joints, const Eigen::Isometry3d& T_base_tip_zero,
                         std::string base_frame, std::string tip_frame)
    : joints_(std::move(joints)),
      T_base_tip_zero_(T_base_tip_zero),
      base_frame_(std::move(base_frame)),
      tip_frame_(std::move(tip_frame)) {
  if (joints_.empty()) {
    throw std::invalid_argument("chain from '" + base_frame_ + "' to '" + tip_frame_ +
                                "' has no moving joint");
  }
  for (const ChainJoint& joint : joints_) checkJoint(joint);
  if (!T_base_tip_zero_.matrix().allFinite())
    throw std::invalid_argument("zero pose of the chain is not finite");
}

SerialChain::SerialChain(std::vector<ChainJoint> joints, std::vector<CoupledAxis> axes,
                         const Eigen::Isometry3d& T_base_tip_zero, std::string base_frame,
                         std::string tip_frame)
    : SerialChain(std::move(joints), T_base_tip_zero, std::move(base_frame), std::move(tip_frame)) {
  for (const CoupledAxis& axis : axes) {
    checkJoint(axis.axis);
    if (axis.joint < 0 || axis.joint >= dof() || !std::isfinite(axis.multiplier))
      throw std::invalid_argument("axis '" + axis.axis.name + "': no such joint, or multiplier not finite");
  }
  coupled_axes_ = std::move(axes);
}

std::vector<CoupledAxis> SerialChain::axes() const {
  if (isCoupled()) return coupled_axes_;
  std::vector<CoupledAxis> axes;
  for (int i = 0; i < dof(); ++i) axes.push_back({joint(i), i, 1.0});
  return axes;
}

Eigen::Isometry3d SerialChain::forward(const double* q) const {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (isCoupled()) {
    for (const CoupledAxis& a : coupled_axes_) T = T * jointMotion(a.axis, a.multiplier * q[a.joint]);
    return T * T_base_tip_zero_;
  }
  for (size_t i = 0; i < joints_.size(); ++i) T = T * jointMotion(joints_[i], q[i]);
  return T * T_base_tip_zero_;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> SerialChain::coupledJacobian(const double* q) const {
  Eigen::Matrix<double, 6, Eigen::Dynamic> J = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, dof());
  const Eigen::Vector3d tip = forward(q).translation();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (const CoupledAxis& a : coupled_axes_) {
    J.col(a.joint) += a.multiplier * twistAt(a.axis, T * a.axis.point, T.linear() * a.axis.axis, tip);
    T = T * jointMotion(a.axis, a.multiplier * q[a.joint]);
  }
  return J;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> SerialChain::jacobian(const double* q) const {
  if (isCoupled()) return coupledJacobian(q);
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, dof());
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int i = 0; i < dof(); ++i) {
    J.col(i) << T * joint(i).point, T.linear() * joint(i).axis;
    T = T * jointMotion(joint(i), q[i]);
  }
  const Eigen::Vector3d tip = T * T_base_tip_zero_.translation();
  for (int i = 0; i < dof(); ++i) {
    const Eigen::Vector3d point = J.col(i).head<3>();
    const Eigen::Vector3d axis = J.col(i).tail<3>();
    J.col(i) = twistAt(joint(i), point, axis, tip);
  }
  return J;
}

double SerialChain::manipulability(const double* q) const {
  const Eigen::Matrix<double, 6, Eigen::Dynamic> J = jacobian(q);
  const double determinant =
      dof() < 6 ? (J.transpose() * J).eval().determinant() : (J * J.transpose()).eval().determinant();
  return std::sqrt(std::max(0.0, determinant));
}

SerialChain SerialChain::withFixedJoint(int i, double value) const {
  if (isCoupled()) throw std::invalid_argument("joint '" + joint(i).name + "' has mimics: it cannot be held");
  const Eigen::Isometry3d motion = jointMotion(joint(i), value);
  std::vector<ChainJoint> rest(joints_.begin(), joints_.begin() + i);
  for (int k = i + 1; k < dof(); ++k) {
    ChainJoint moved = joint(k);
    moved.axis = (motion.linear() * moved.axis).normalized();
    moved.point = motion * moved.point;
    rest.push_back(moved);
  }
  return SerialChain(std::move(rest), motion * T_base_tip_zero_, base_frame_, tip_frame_);
}

SerialChain SerialChain::withLimits(int i, double lower, double upper) const {
  std::vector<ChainJoint> joints = joints_;
  joints[static_cast<size_t>(i)].lower = lower;
  joints[static_cast<size_t>(i)].upper = upper;
  return SerialChain(std::move(joints), coupled_axes_, T_base_tip_zero_, base_frame_, tip_frame_);
}

bool SerialChain::withinLimits(const double* q, double tolerance) const {
  for (int i = 0; i < dof(); ++i) {
    const bool inside = q[i] >= joint(i).lower - tolerance && q[i] <= joint(i).upper + tolerance;
    if (!inside) return false;  // also for NaN
  }
  return true;
}

ReachBound reachBound(const SerialChain& chain) {
  // Vertices: one per axis, then the tip. Prismatic axes have no fixed place: they add their stroke instead.
  std::vector<ChainJoint> axes;
  double strokes = 0.0;
  for (const CoupledAxis& a : chain.axes()) {
    const ChainJoint& leader = chain.joint(a.joint);
    if (a.axis.prismatic) {
      strokes += std::abs(a.multiplier) * std::max(std::abs(leader.lower), std::abs(leader.upper));
    } else {
      axes.push_back(a.axis);
    }
  }
  std::vector<Eigen::Vector3d> vertices;
  for (const ChainJoint& axis : axes) vertices.push_back(axis.point);
  vertices.push_back(chain.zeroPose().translation());
  if (axes.empty()) return {vertices.back(), strokes};

  // A convex problem (a sum of norms of affine functions); any point of the descent is a valid bound.
  constexpr int kSweeps = 2000;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const double before = polylineLength(vertices);
    for (size_t i = axes.size(); i-- > 1;)
      vertices[i] = shortestVia(axes[i], vertices[i - 1], vertices[i + 1]);
    vertices[0] = axes[0].point + axes[0].axis.dot(vertices[1] - axes[0].point) * axes[0].axis;
    if (before - polylineLength(vertices) < 1e-13) break;
  }
  return {vertices[0], polylineLength(vertices) + strokes};
}

}  // namespace fv_robot_model::ik
