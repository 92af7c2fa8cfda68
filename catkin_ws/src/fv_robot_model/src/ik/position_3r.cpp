#include "position_3r.h"

#include <cmath>

#include "fv_robot_model/ik/ik_solver.h"

namespace fv_robot_model::ik {

namespace {

constexpr double kSameAxis =
    1e-7;  // relative offsets below this count as none; Newton steps remove the error

/// Feet of the common normal of two lines that are not parallel.
std::array<Eigen::Vector3d, 2> commonNormalFeet(const ChainJoint& a, const ChainJoint& b) {
  const Eigen::Vector3d d = b.point - a.point;
  const double cosine = a.axis.dot(b.axis);
  const double sine2 = a.axis.cross(b.axis).squaredNorm();
  const double s = (d.dot(a.axis) - cosine * d.dot(b.axis)) / sine2;
  const double t = (cosine * d.dot(a.axis) - d.dot(b.axis)) / sine2;
  return {a.point + s * a.axis, b.point + t * b.axis};
}

}  // namespace

Position3R::Position3R(const std::array<ChainJoint, 3>& axes, const Eigen::Vector3d& p,
                       double limit_tolerance)
    : tolerance_(limit_tolerance) {
  for (size_t i = 0; i < 3; ++i) {
    h_[i] = axes[i].axis;
    limits_.lower[i] = axes[i].lower;
    limits_.upper[i] = axes[i].upper;
  }
  cos_alpha_ = h_[0].dot(h_[1]);
  const bool parallel = h_[0].cross(h_[1]).norm() < kSameAxis;
  Eigen::Vector3d r2;
  if (parallel) {
    r2 = axes[1].point;
    r1_ = axes[0].point + h_[0].dot(r2 - axes[0].point) * h_[0];
  } else {
    const auto feet = commonNormalFeet(axes[0], axes[1]);
    r1_ = feet[0];
    r2 = feet[1];
  }
  p1_ = r2 - r1_;
  const Eigen::Vector3d r3 = axes[2].point + h_[2].dot(r2 - axes[2].point) * h_[2];
  p2_ = r3 - r2;
  p3_ = p - r3;
  scale_ = std::max(1e-3, p1_.norm() + p2_.norm() + p3_.norm());
  a_ = p1_.norm();
  const bool meeting = a_ < kSameAxis * scale_;
  kind_ = parallel ? (meeting ? Kind::Coaxial : Kind::Parallel) : (meeting ? Kind::Meeting : Kind::Skew);
  if (!meeting) {
    n_ = (p1_ - h_[1].dot(p1_) * h_[1]).normalized();
    e2_ = h_[1].cross(n_);
    sin_alpha_ = h_[0].dot(e2_);
  }
  k_ = h_[2].dot(p3_) * h_[2];
  m_ = p3_ - k_;
  l_ = h_[2].cross(p3_);
}

bool Position3R::fit(int joint, double& q) const {
  const auto i = static_cast<size_t>(joint);
  return fitToLimits(q, limits_.lower[i], limits_.upper[i], tolerance_);
}

Position3R::Linear Position3R::squaredDistance() const {
  return {p2_.squaredNorm() + p3_.squaredNorm() + 2.0 * p2_.dot(k_), 2.0 * p2_.dot(m_), 2.0 * p2_.dot(l_)};
}

void Position3R::solve(const Eigen::Vector3d& target, Solutions& out) const {
  out.count = 0;
  const Eigen::Vector3d v = target - r1_;
  if (kind_ == Kind::Meeting) {
    solveMeeting(v, out);
  } else if (kind_ == Kind::Parallel) {
    solveParallel(v, out);
  } else {
    solveSkew(v, out);
  }
}

void Position3R::solveMeeting(const Eigen::Vector3d& v, Solutions& out) const {
  // Turns about axes 1 and 2 keep the distance from their common point: |v|^2 = |p2 + R3 p3|^2.
  const Linear d2 = squaredDistance();
  const TrigRoots third = trigRoots(d2.cosine, d2.sine, v.squaredNorm() - d2.constant, scale_ * scale_);
  for (int i = 0; i < third.count; ++i) {
    const CosSin& a3 = third.root[static_cast<size_t>(i)];
    double q3 = a3.angle();
    if (!fit(2, q3)) continue;
    // A turn about axis 1 keeps the height along it: h1 . v = h1 . R2 f.
    const Eigen::Vector3d f = p2_ + k_ + a3.c * m_ + a3.s * l_;
    const double along = h_[1].dot(f);
    const double cosine = h_[0].dot(f) - cos_alpha_ * along;
    const double sine = h_[0].dot(h_[1].cross(f));
    const TrigRoots second = trigRoots(cosine, sine, h_[0].dot(v) - cos_alpha_ * along, scale_);
    for (int j = 0; j < second.count; ++j) first(v, second.root[static_cast<size_t>(j)], a3, q3, out);
  }
}

void Position3R::solveParallel(const Eigen::Vector3d& v, Solutions& out) const {
  // Turns about the parallel axes 1 and 2 keep the height along them.
  const double sign = cos_alpha_ > 0.0 ? 1.0 : -1.0;
  const double rhs = sign * h_[0].dot(v) - h_[1].dot(p2_ + k_);
  const TrigRoots third = trigRoots(h_[1].dot(m_), h_[1].dot(l_), rhs, scale_);
  const Linear d2 = squaredDistance();
  for (int i = 0; i < third.count; ++i) {
    const CosSin& a3 = third.root[static_cast<size_t>(i)];
    double q3 = a3.angle();
    if (!fit(2, q3)) continue;
    const Eigen::Vector3d f = p2_ + k_ + a3.c * m_ + a3.s * l_;
    const double height = h_[1].dot(f);
    const double flat2 = d2.at(a3) - height * height;
    const double X = (v.squaredNorm() - a_ * a_ - d2.at(a3)) / (2.0 * a_);
    const double Y2 = flat2 - X * X;
    if (Y2 < -1e-9 * scale_ * scale_) continue;
    const double Y = std::sqrt(std::max(0.0, Y2));
    secondFromPlane(v, a3, q3, X, Y, out);
    if (Y > 0.0) secondFromPlane(v, a3, q3, X, -Y, out);
  }
}

void Position3R::solveSkew(const Eigen::Vector3d& v, Solutions& out) const {
  // With g = R2 f in the frame (n, e2, h2): the distance from axis 1's foot gives X, the height along axis 1
  // gives Y, and X^2 + Y^2 + Z^2 = |f|^2 is left for the third angle.
  const Linear d2 = squaredDistance();
  const double base = v.squaredNorm() - a_ * a_;
  const Linear X{(base - d2.constant) / (2.0 * a_), -d2.cosine / (2.0 * a_), -d2.sine / (2.0 * a_)};
  const Linear Z{h_[1].dot(p2_ + k_), h_[1].dot(m_), h_[1].dot(l_)};
  const Linear Y{(h_[0].dot(v) - cos_alpha_ * Z.constant) / sin_alpha_, -cos_alpha_ * Z.cosine / sin_alpha_,
                 -cos_alpha_ * Z.sine / sin_alpha_};
  std::array<double, 6> k{-d2.constant, -d2.cosine, -d2.sine, 0.0, 0.0, 0.0};
  for (const Linear& u : {X, Y, Z}) {
    k[0] += u.constant * u.constant;
    k[1] += 2.0 * u.constant * u.cosine;
    k[2] += 2.0 * u.constant * u.sine;
    k[3] += u.cosine * u.cosine;
    k[4] += 2.0 * u.cosine * u.sine;
    k[5] += u.sine * u.sine;
  }
  const QuarticAngles third = quarticAngles(k);
  for (int i = 0; i < third.count; ++i) {
    const CosSin& a3 = third.root[static_cast<size_t>(i)];
    double q3 = a3.angle();
    if (fit(2, q3)) secondFromPlane(v, a3, q3, X.at(a3), Y.at(a3), out);
  }
}

void Position3R::secondFromPlane(const Eigen::Vector3d& v, const CosSin& third, double q3, double X, double Y,
                                 Solutions& out) const {
  const Eigen::Vector3d f = p2_ + k_ + third.c * m_ + third.s * l_;
  const double x = n_.dot(f);
  const double y = e2_.dot(f);
  const double c = x * X + y * Y;
  const double s = x * Y - y * X;
  const double norm = std::hypot(c, s);
  if (norm < 1e-14 * scale_ * scale_) return;  // f on axis 2: the turn about it is free, a singular position
  first(v, {c / norm, s / norm}, third, q3, out);
}

void Position3R::first(const Eigen::Vector3d& v, const CosSin& second, const CosSin& third, double q3,
                       Solutions& out) const {
  double q2 = second.angle();
  if (!fit(1, q2)) return;
  const Eigen::Vector3d f = p2_ + k_ + third.c * m_ + third.s * l_;
  const AlignedAngle turned = alignAbout(h_[0], p1_ + turn(h_[1], second, f), v, scale_);
  // On the first axis every angle will do: spread some over the range.
  const int samples = turned.any_angle ? 8 : 1;
  for (int i = 0; i < samples && out.count < static_cast<int>(out.item.size()); ++i) {
    double q1 = turned.any_angle
                    ? limits_.lower[0] + (limits_.upper[0] - limits_.lower[0]) * (i + 0.5) / samples
                    : turned.angle.angle();
    if (!fit(0, q1)) continue;
    const CosSin a1 = turned.any_angle ? cosSin(q1) : turned.angle;
    Solution& solution = out.item[static_cast<size_t>(out.count++)];
    solution.q = {q1, q2, q3};
    solution.R = rotationAbout(h_[0], a1.c, a1.s) * rotationAbout(h_[1], second.c, second.s) *
                 rotationAbout(h_[2], third.c, third.s);
  }
}

}  // namespace fv_robot_model::ik
