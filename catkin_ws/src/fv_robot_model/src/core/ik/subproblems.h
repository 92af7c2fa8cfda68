#pragma once

// The geometric subproblems that closed forms are made of. Sources: Paden (1986) and Kahan; Elias and Wen,
// "IK-Geo: Unified robot inverse kinematics using subproblem decomposition", Mech. Mach. Theory 2025.

#include <Eigen/Geometry>
#include <array>
#include <cmath>

namespace fv_robot_model::ik {

/// An angle as cosine and sine, so that rotations need no trigonometric function.
struct CosSin {
  double c{1.0};
  double s{0.0};
  double angle() const { return std::atan2(s, c); }
};

inline CosSin cosSin(double angle) { return {std::cos(angle), std::sin(angle)}; }

/// x turned about the unit axis h (Rodrigues).
inline Eigen::Vector3d turn(const Eigen::Vector3d& h, const CosSin& a, const Eigen::Vector3d& x) {
  return a.c * x + a.s * h.cross(x) + (1.0 - a.c) * h.dot(x) * h;
}

/// The up to two angles with b cos + c sin = rhs.
struct TrigRoots {
  std::array<CosSin, 2> root;
  int count{0};
  bool any_angle{false};  ///< b = c = rhs = 0: every angle solves it; count is 0.
};

/// @param scale Magnitude of the numbers that b, c and rhs are differences of: below 1e-12 of it they are
/// noise.
inline TrigRoots trigRoots(double b, double c, double rhs, double scale) {
  TrigRoots result;
  const double n2 = b * b + c * c;
  if (n2 < 1e-24 * scale * scale) {
    result.any_angle = std::abs(rhs) < 1e-9 * scale;
    return result;
  }
  const double discriminant = n2 - rhs * rhs;
  // Grazing solutions (an arm just stretched) may miss by rounding: taken as touching, and polished
  // afterwards.
  if (discriminant < -1e-9 * n2) return result;
  const double root = std::sqrt(std::max(0.0, discriminant));
  const double inverse = discriminant < 0.0 ? 1.0 / (std::sqrt(n2) * std::abs(rhs)) : 1.0 / n2;
  result.root[0] = {(b * rhs - c * root) * inverse, (c * rhs + b * root) * inverse};
  result.root[1] = {(b * rhs + c * root) * inverse, (c * rhs - b * root) * inverse};
  result.count = root > 0.0 ? 2 : 1;
  return result;
}

/// Subproblem 1: the angle about h that takes p to q, both projected onto the plane across h.
struct AlignedAngle {
  CosSin angle;
  bool any_angle{false};  ///< p or q lies on the axis.
  double norm{0.0};       ///< Product of the distances of p and q from the axis.
};

inline AlignedAngle alignAbout(const Eigen::Vector3d& h, const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                               double scale) {
  const double c = p.dot(q) - h.dot(p) * h.dot(q);
  const double s = h.dot(p.cross(q));
  const double norm = std::sqrt(c * c + s * s);
  if (norm < 1e-14 * scale * scale) return {{1.0, 0.0}, true, norm};
  return {{c / norm, s / norm}, false, norm};
}

/// Real roots of a monic or general polynomial of degree <= 4, coefficients by ascending power.
struct RealRoots {
  std::array<double, 5> root;
  int count{0};
};
RealRoots realRoots(const std::array<double, 5>& coefficients, int degree);

/// The up to four angles with k0 + k1 c + k2 s + k3 c^2 + k4 c s + k5 s^2 = 0.
struct QuarticAngles {
  std::array<CosSin, 5> root;
  int count{0};
};
QuarticAngles quarticAngles(const std::array<double, 6>& k);

}  // namespace fv_robot_model::ik
