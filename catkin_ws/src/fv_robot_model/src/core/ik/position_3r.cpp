#include "position_3r.h"

#include <cmath>

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
                       double limit_tolerance) {
  for (size_t i = 0; i < 3; ++i) {
    h_[i] = axes[i].axis;
    ranges_[i] = JointRange(axes[i], limit_tolerance);
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
  const Eigen::Vector3d p2 = r3 - r2;
  const Eigen::Vector3d p3 = p - r3;
  scale_ = std::max(1e-3, p1_.norm() + p2.norm() + p3.norm());
  a_ = p1_.norm();
  const bool meeting = a_ < kSameAxis * scale_;
  kind_ = parallel ? (meeting ? Kind::Coaxial : Kind::Parallel) : (meeting ? Kind::Meeting : Kind::Skew);
  if (!meeting) {
    n_ = (p1_ - h_[1].dot(p1_) * h_[1]).normalized();
    e2_ = h_[1].cross(n_);
    sin_alpha_ = h_[0].dot(e2_);
  }
  const Eigen::Vector3d k = h_[2].dot(p3) * h_[2];
  f0_ = p2 + k;
  m_ = p3 - k;
  l_ = h_[2].cross(p3);
  squared_distance_ = {p2.squaredNorm() + p3.squaredNorm() + 2.0 * p2.dot(k), 2.0 * p2.dot(m_),
                       2.0 * p2.dot(l_)};
}

bool Position3R::angles(const Solution& solution, double* q) const {
  for (size_t i = 0; i < 3; ++i) {
    q[i] = solution.angle[i].angle();
    if (!ranges_[i].fit(q[i])) return false;
  }
  return true;
}

Eigen::Matrix3d Position3R::remaining(const Solution& solution, const Eigen::Matrix3d& R) const {
  Eigen::Matrix3d rest = R;
  for (size_t i = 0; i < 3; ++i) {
    const CosSin back{solution.angle[i].c, -solution.angle[i].s};
    for (Eigen::Index column = 0; column < 3; ++column)
      rest.col(column) = turn(h_[i], back, rest.col(column));
  }
  return rest;
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
  const Linear& d2 = squared_distance_;
  const TrigRoots third = trigRoots(d2.cosine, d2.sine, v.squaredNorm() - d2.constant, scale_ * scale_);
  for (int i = 0; i < third.count; ++i) {
    const CosSin& a3 = third.root[static_cast<size_t>(i)];
    if (!ranges_[2].admits(a3)) continue;
    // A turn about axis 1 keeps the height along it: h1 . v = h1 . R2 f.
    const Eigen::Vector3d f = carriedBy(a3);
    const double along = h_[1].dot(f);
    const double cosine = h_[0].dot(f) - cos_alpha_ * along;
    const double sine = h_[0].dot(h_[1].cross(f));
    const TrigRoots second = trigRoots(cosine, sine, h_[0].dot(v) - cos_alpha_ * along, scale_);
    for (int j = 0; j < second.count; ++j) first(v, second.root[static_cast<size_t>(j)], a3, f, out);
  }
}

void Position3R::solveParallel(const Eigen::Vector3d& v, Solutions& out) const {
  // Turns about the parallel axes 1 and 2 keep the height along them.
  const double sign = cos_alpha_ > 0.0 ? 1.0 : -1.0;
  const double rhs = sign * h_[0].dot(v) - h_[1].dot(f0_);
  const TrigRoots third = trigRoots(h_[1].dot(m_), h_[1].dot(l_), rhs, scale_);
  for (int i = 0; i < third.count; ++i) {
    const CosSin& a3 = third.root[static_cast<size_t>(i)];
    if (!ranges_[2].admits(a3)) continue;
    const double height = h_[1].dot(carriedBy(a3));
    const double squared = squared_distance_.at(a3);
    const double X = (v.squaredNorm() - a_ * a_ - squared) / (2.0 * a_);
    const double Y2 = squared - height * height - X * X;
    if (Y2 < -1e-9 * scale_ * scale_) continue;
    const double Y = std::sqrt(std::max(0.0, Y2));
    secondFromPlane(v, a3, X, Y, out);
    if (Y > 0.0) secondFromPlane(v, a3, X, -Y, out);
  }
}

void Position3R::solveSkew(const Eigen::Vector3d& v, Solutions& out) const {
  // With g = R2 f in the frame (n, e2, h2): the distance from axis 1's foot gives X, the height along axis 1
  // gives Y, and X^2 + Y^2 + Z^2 = |f|^2 is left for the third angle.
  const Linear& d2 = squared_distance_;
  const double base = v.squaredNorm() - a_ * a_;
  const Linear X{(base - d2.constant) / (2.0 * a_), -d2.cosine / (2.0 * a_), -d2.sine / (2.0 * a_)};
  const Linear Z{h_[1].dot(f0_), h_[1].dot(m_), h_[1].dot(l_)};
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
    if (ranges_[2].admits(a3)) secondFromPlane(v, a3, X.at(a3), Y.at(a3), out);
  }
}

void Position3R::secondFromPlane(const Eigen::Vector3d& v, const CosSin& third, double X, double Y,
                                 Solutions& out) const {
  const Eigen::Vector3d f = carriedBy(third);
  const double x = n_.dot(f);
  const double y = e2_.dot(f);
  const double c = x * X + y * Y;
  const double s = x * Y - y * X;
  const double norm = std::sqrt(c * c + s * s);
  if (norm < 1e-14 * scale_ * scale_) return;  // f on axis 2: the turn about it is free, a singular position
  first(v, {c / norm, s / norm}, third, f, out);
}

void Position3R::first(const Eigen::Vector3d& v, const CosSin& second, const CosSin& third,
                       const Eigen::Vector3d& f, Solutions& out) const {
  if (!ranges_[1].admits(second)) return;
  const Eigen::Vector3d carried = p1_ + turn(h_[1], second, f);
  const AlignedAngle turned = alignAbout(h_[0], carried, v, scale_);
  // On the first axis every angle will do: spread some over the range.
  const int samples = turned.any_angle ? 8 : 1;
  for (int i = 0; i < samples && out.count < static_cast<int>(out.item.size()); ++i) {
    const double share = (i + 0.5) / samples;
    const CosSin a1 = turned.any_angle
                          ? cosSin(ranges_[0].lower() + (ranges_[0].upper() - ranges_[0].lower()) * share)
                          : turned.angle;
    if (!ranges_[0].admits(a1)) continue;
    const double missed = (turn(h_[0], a1, carried) - v).norm();
    out.item[static_cast<size_t>(out.count++)] = {{a1, second, third}, missed};
  }
}

}  // namespace fv_robot_model::ik
