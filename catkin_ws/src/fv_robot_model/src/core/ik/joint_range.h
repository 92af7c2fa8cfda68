/// The limits of one revolute joint, asked first by cosine and sine: most branches are out of limits, and
/// these need no arc tangent.
#pragma once

#include <algorithm>
#include <cmath>

#include "fv_robot_model/ik/ik_solver.h"
#include "subproblems.h"

namespace fv_robot_model::ik {

class JointRange {
 public:
  JointRange() = default;
  JointRange(double lower, double upper, double tolerance)
      : lower_(lower), upper_(upper), tolerance_(tolerance), middle_(cosSin(0.5 * (lower + upper))) {
    constexpr double kRounding = 1e-15;  // of the cosine below: never refuses what angle() would take
    const double half = 0.5 * (upper - lower) + tolerance;
    least_cosine_ = half >= M_PI ? -2.0 : std::cos(half) - kRounding;
  }
  JointRange(const ChainJoint& joint, double tolerance) : JointRange(joint.lower, joint.upper, tolerance) {}

  double lower() const { return lower_; }
  double upper() const { return upper_; }

  /// False when no copy of the angle is within the limits. True may be wrong by rounding: fit() has the last
  /// word.
  bool admits(const CosSin& a) const { return a.c * middle_.c + a.s * middle_.s >= least_cosine_; }

  /// fitToLimits() with these limits.
  bool fit(double& angle) const { return fitToLimits(angle, lower_, upper_, tolerance_); }

 private:
  double lower_{0.0};
  double upper_{0.0};
  double tolerance_{0.0};
  CosSin middle_;
  double least_cosine_{-2.0};
};

}  // namespace fv_robot_model::ik
