/// Three revolute axes carry a point: which angles bring it to a target?
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "joint_range.h"
#include "subproblems.h"

namespace fv_robot_model::ik {

/// Solves e1(q1) e2(q2) e3(q3) p = target for general axes: at most four solutions.
/// Three cases by the first two axes: they meet (two quadratics), are parallel (two quadratics), or are skew
/// (a quartic in the third angle, after Pieper 1968 and subproblem 5 of Elias and Wen).
class Position3R {
 public:
  struct Solution {
    std::array<CosSin, 3> angle;
    double error_m;  ///< How far e1 e2 e3 p misses the target.
  };
  struct Solutions {
    std::array<Solution, 32> item;
    int count{0};
  };

  Position3R() = default;
  /// @param axes Three revolute joints with limits. @param p The carried point at zero [m].
  Position3R(const std::array<ChainJoint, 3>& axes, const Eigen::Vector3d& p, double limit_tolerance);

  /// False when the first two axes are one and the same: then the problem has no closed form here.
  bool solvable() const { return kind_ != Kind::Coaxial; }

  /// Solutions within limits, up to rounding: angles() has the last word.
  void solve(const Eigen::Vector3d& target, Solutions& out) const;

  /// The solution's joint values. @return false when one of them is beyond its limits.
  bool angles(const Solution& solution, double* q) const;

  /// (R1 R2 R3)^T R for a solution's rotations.
  Eigen::Matrix3d remaining(const Solution& solution, const Eigen::Matrix3d& R) const;

 private:
  enum class Kind { Meeting, Parallel, Skew, Coaxial };
  struct Linear {  // constant + cosine c3 + sine s3
    double constant, cosine, sine;
    double at(const CosSin& a) const { return constant + cosine * a.c + sine * a.s; }
  };

  void solveMeeting(const Eigen::Vector3d& v, Solutions& out) const;
  void solveParallel(const Eigen::Vector3d& v, Solutions& out) const;
  void solveSkew(const Eigen::Vector3d& v, Solutions& out) const;
  void secondFromPlane(const Eigen::Vector3d& v, const CosSin& third, double X, double Y,
                       Solutions& out) const;
  void first(const Eigen::Vector3d& v, const CosSin& second, const CosSin& third, const Eigen::Vector3d& f,
             Solutions& out) const;
  Eigen::Vector3d carriedBy(const CosSin& third) const { return f0_ + third.c * m_ + third.s * l_; }

  Kind kind_{Kind::Coaxial};
  std::array<Eigen::Vector3d, 3> h_;
  std::array<JointRange, 3> ranges_;
  double scale_{1.0};
  Eigen::Vector3d r1_, p1_, p2_, p3_;  // point of axis 1; axis 1 to 2, axis 2 to 3, axis 3 to p
  Eigen::Vector3d n_, e2_;             // across axis 2: along the common normal, and h2 x n
  Eigen::Vector3d f0_, m_, l_;         // p2 + R3 p3 = f0 + m c3 + l s3
  Linear squared_distance_{};          // of that
  double a_{0.0}, cos_alpha_{1.0}, sin_alpha_{0.0};
};

}  // namespace fv_robot_model::ik
