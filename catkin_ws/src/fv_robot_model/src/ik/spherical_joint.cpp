#include "spherical_joint.h"

#include "fv_robot_model/ik/ik_solver.h"

namespace fv_robot_model::ik {

SphericalJoint::SphericalJoint(const std::array<Eigen::Vector3d, 3>& axes, const Limits3& limits,
                               double limit_tolerance)
    : h_(axes), limits_(limits), tolerance_(limit_tolerance) {
  constant_ = h_[0].dot(h_[1]) * h_[1].dot(h_[2]);
  cosine_ = h_[0].dot(h_[2]) - constant_;
  sine_ = h_[0].dot(h_[1].cross(h_[2]));
}

void SphericalJoint::solve(const Eigen::Matrix3d& R, Solutions& out) const {
  out.count = 0;
  const TrigRoots roots = trigRoots(cosine_, sine_, h_[0].dot(R * h_[2]) - constant_, 1.0);
  for (int i = 0; i < roots.count; ++i) solveMiddle(R, roots.root[static_cast<size_t>(i)], out);
}

void SphericalJoint::solveMiddle(const Eigen::Matrix3d& R, const CosSin& middle, Solutions& out) const {
  double q2 = middle.angle();
  if (!fitToLimits(q2, limits_.lower[1], limits_.upper[1], tolerance_)) return;
  const Eigen::Vector3d w = turn(h_[1], middle, h_[2]);
  const AlignedAngle first = alignAbout(h_[0], w, R * h_[2], 1.0);
  const Eigen::Vector3d u = turn(h_[1], {middle.c, -middle.s}, h_[0]);
  const AlignedAngle last = alignAbout(h_[2], R.transpose() * h_[0], u, 1.0);
  if (first.any_angle || last.any_angle) {
    sampleFirst(R, q2, rotationAbout(h_[1], middle.c, middle.s), out);
    return;
  }
  append(first.angle.angle(), q2, last.angle.angle(), out);
}

void SphericalJoint::sampleFirst(const Eigen::Matrix3d& R, double q2, const Eigen::Matrix3d& R2,
                                 Solutions& out) const {
  // First and last axis fall together: only the sum of their angles is given. Spread the first over its
  // range.
  constexpr int kSamples = 7;
  const Eigen::Vector3d across = h_[2].unitOrthogonal();
  for (int i = 0; i < kSamples; ++i) {
    const double q1 = limits_.lower[0] + (limits_.upper[0] - limits_.lower[0]) * i / (kSamples - 1);
    const Eigen::Matrix3d R1 = rotationAbout(h_[0], std::cos(q1), std::sin(q1));
    const Eigen::Vector3d turned = R2.transpose() * (R1.transpose() * (R * across));
    append(q1, q2, alignAbout(h_[2], across, turned, 1.0).angle.angle(), out);
  }
}

void SphericalJoint::append(double q1, double q2, double q3, Solutions& out) const {
  if (!fitToLimits(q1, limits_.lower[0], limits_.upper[0], tolerance_)) return;
  if (!fitToLimits(q3, limits_.lower[2], limits_.upper[2], tolerance_)) return;
  if (out.count == static_cast<int>(out.q.size())) return;
  out.q[static_cast<size_t>(out.count++)] = {q1, q2, q3};
}

}  // namespace fv_robot_model::ik
