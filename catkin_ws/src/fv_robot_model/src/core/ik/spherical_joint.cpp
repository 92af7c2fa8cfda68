#include "spherical_joint.h"

namespace fv_robot_model::ik {

SphericalJoint::SphericalJoint(const std::array<ChainJoint, 3>& joints, double limit_tolerance) {
  for (size_t i = 0; i < 3; ++i) {
    h_[i] = joints[i].axis;
    ranges_[i] = JointRange(joints[i], limit_tolerance);
  }
  constant_ = h_[0].dot(h_[1]) * h_[1].dot(h_[2]);
  cosine_ = h_[0].dot(h_[2]) - constant_;
  sine_ = h_[0].dot(h_[1].cross(h_[2]));
}

void SphericalJoint::solve(const Eigen::Matrix3d& R, Solutions& out) const {
  out.count = 0;
  const TrigRoots roots = trigRoots(cosine_, sine_, h_[0].dot(R * h_[2]) - constant_, 1.0);
  for (int i = 0; i < roots.count; ++i) {
    const CosSin& middle = roots.root[static_cast<size_t>(i)];
    if (ranges_[1].admits(middle)) solveMiddle(R, middle, out);
  }
}

void SphericalJoint::solveMiddle(const Eigen::Matrix3d& R, const CosSin& middle, Solutions& out) const {
  const Eigen::Vector3d w = turn(h_[1], middle, h_[2]);
  const Eigen::Vector3d w_wanted = R * h_[2];
  const AlignedAngle first = alignAbout(h_[0], w, w_wanted, 1.0);
  if (!first.any_angle && !ranges_[0].admits(first.angle)) return;
  const Eigen::Vector3d u = turn(h_[1], {middle.c, -middle.s}, h_[0]);
  const Eigen::Vector3d u_wanted = R.transpose() * h_[0];
  const AlignedAngle last = alignAbout(h_[2], u_wanted, u, 1.0);
  if (first.any_angle || last.any_angle) return sampleFirst(R, middle, out);
  if (!ranges_[2].admits(last.angle)) return;
  // R1 R2 R3 takes h3 to w turned, its inverse takes h1 to u turned: rotations that agree with R in both
  // differ by at most the sum of what is missed over the sine between h1 and w.
  const double missed = (turn(h_[0], first.angle, w) - w_wanted).norm() +
                        (turn(h_[2], {last.angle.c, -last.angle.s}, u) - u_wanted).norm();
  append(first.angle.angle(), middle.angle(), last.angle.angle(), missed / std::sqrt(first.norm), out);
}

void SphericalJoint::sampleFirst(const Eigen::Matrix3d& R, const CosSin& middle, Solutions& out) const {
  // First and last axis fall together: only the sum of their angles is given. Spread the first over its
  // range.
  constexpr int kSamples = 7;
  constexpr double kUnknown = 1.0;  // [rad] the caller has to measure
  const Eigen::Matrix3d R2 = rotationAbout(h_[1], middle.c, middle.s);
  const Eigen::Vector3d across = h_[2].unitOrthogonal();
  for (int i = 0; i < kSamples; ++i) {
    const double q1 = ranges_[0].lower() + (ranges_[0].upper() - ranges_[0].lower()) * i / (kSamples - 1);
    const Eigen::Matrix3d R1 = rotationAbout(h_[0], std::cos(q1), std::sin(q1));
    const Eigen::Vector3d turned = R2.transpose() * (R1.transpose() * (R * across));
    const AlignedAngle last = alignAbout(h_[2], across, turned, 1.0);
    append(q1, middle.angle(), last.angle.angle(), kUnknown, out);
  }
}

void SphericalJoint::append(double q1, double q2, double q3, double error_rad, Solutions& out) const {
  if (!ranges_[0].fit(q1) || !ranges_[1].fit(q2) || !ranges_[2].fit(q3)) return;
  if (out.count == static_cast<int>(out.item.size())) return;
  out.item[static_cast<size_t>(out.count++)] = {{q1, q2, q3}, error_rad};
}

}  // namespace fv_robot_model::ik
