// 7R with three axes through a shoulder point and three through a wrist point (KUKA iiwa).
//
// The distance from shoulder to wrist gives the elbow's angle. What is left is one circle of elbow places,
// the arm angle psi about the line from shoulder to wrist. Each joint limit is met at the roots of an
// equation a + b cos psi + c sin psi = 0, so the feasible intervals of psi are known exactly (the idea of
// Shimizu et al., "Analytical inverse kinematic computation for 7-DOF redundant manipulators with joint
// limits", T-RO 2008): between neighbouring roots either every angle works for a branch or none does. A pose
// is never missed for a coarse step.

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "solvers.h"
#include "spherical_joint.h"

namespace fv_robot_model::ik {

namespace {

/// Angles at which something changes, ascending when sorted; fixed room, no allocation.
struct Breaks {
  std::array<double, 80> angle;
  int count{0};
  void add(const TrigRoots& roots) {
    for (int i = 0; i < roots.count; ++i)
      angle[static_cast<size_t>(count++)] = roots.root[static_cast<size_t>(i)].angle();
  }
};

/// Breaks of one spherical joint whose rotation is L Rot(axis, sign psi) R.
class TripleBreaks {
 public:
  TripleBreaks() = default;
  explicit TripleBreaks(const std::array<ChainJoint, 3>& joints) {
    for (size_t i = 0; i < 3; ++i) h_[i] = joints[i].axis;
    for (size_t i = 0; i < 3; ++i) bounded_[i] = joints[i].upper - joints[i].lower < 2.0 * M_PI;
    for (size_t side = 0; side < 2; ++side) {
      const auto limit = [&](size_t i) { return cosSin(side == 0 ? joints[i].lower : joints[i].upper); };
      first_[side] = turn(h_[0], limit(0), h_[1]);
      middle_[side] = h_[0].dot(turn(h_[1], limit(1), h_[2]));
      const CosSin last = limit(2);
      last_[side] = turn(h_[2], {last.c, -last.s}, h_[1]);
    }
    const double constant = h_[0].dot(h_[1]) * h_[1].dot(h_[2]);
    const double spread = std::hypot(h_[0].dot(h_[2]) - constant, h_[0].dot(h_[1].cross(h_[2])));
    fold_ = {constant - spread, constant + spread};
  }

  /// Where R(psi) = left Rot(axis, sign psi) right meets a limit or folds from one branch into the other.
  void collect(const Eigen::Matrix3d& left, const Eigen::Vector3d& axis, double sign,
               const Eigen::Matrix3d& right, Breaks& breaks) const {
    const Eigen::Vector3d a1 = left.transpose() * h_[0];
    const Eigen::Vector3d b3 = right * h_[2];
    for (size_t side = 0; side < 2; ++side) {
      if (bounded_[0]) add(left.transpose() * first_[side], axis, sign, b3, h_[1].dot(h_[2]), breaks);
      if (bounded_[1]) add(a1, axis, sign, b3, middle_[side], breaks);
      if (bounded_[2]) add(a1, axis, sign, right * last_[side], h_[0].dot(h_[1]), breaks);
      add(a1, axis, sign, b3, fold_[side], breaks);
    }
  }

 private:
  /// Roots of a . Rot(axis, sign psi) b = value.
  static void add(const Eigen::Vector3d& a, const Eigen::Vector3d& axis, double sign,
                  const Eigen::Vector3d& b, double value, Breaks& breaks) {
    const double constant = axis.dot(a) * axis.dot(b);
    breaks.add(trigRoots(a.dot(b) - constant, sign * a.dot(axis.cross(b)), value - constant, 1.0));
  }

  std::array<Eigen::Vector3d, 3> h_;
  std::array<bool, 3> bounded_{};
  std::array<Eigen::Vector3d, 2> first_, last_;  // axis 2 as the limits of joints 1 and 3 turn it
  std::array<double, 2> middle_{}, fold_{};
};

std::array<ChainJoint, 3> tripleOf(const SerialChain& chain, int first) {
  return {chain.joint(first), chain.joint(first + 1), chain.joint(first + 2)};
}

class ShoulderElbowWrist7R : public IkSolver {
 public:
  ShoulderElbowWrist7R(const SerialChain& chain, const IkOptions& options, const Eigen::Vector3d& shoulder,
                       const Eigen::Vector3d& wrist)
      : IkSolver(chain, options),
        shoulder_(shoulder),
        wrist_(wrist),
        T_zero_inverse_(chain.zeroPose().inverse()),
        upper_(tripleOf(chain, 0), options.limit_tolerance_rad),
        lower_(tripleOf(chain, 4), options.limit_tolerance_rad),
        upper_breaks_(tripleOf(chain, 0)),
        lower_breaks_(tripleOf(chain, 4)) {}

  bool exact() const override { return true; }
  std::string family() const override { return "shoulder-elbow-wrist-7R"; }
  std::string name() const override {
    std::ostringstream text;
    text << family() << ": closed form over the arm angle with exact feasible intervals, because the axes of "
         << chain_.joint(0).name << " to " << chain_.joint(2).name << " and of " << chain_.joint(4).name
         << " to " << chain_.joint(6).name << " meet in one point each";
    return text.str();
  }

  void solvePose(const Eigen::Isometry3d& T_base_tip, const double* /*seed*/,
                 IkSolutions& out) const override {
    const Eigen::Isometry3d E = T_base_tip * T_zero_inverse_;
    const Eigen::Vector3d w = E * wrist_ - shoulder_;
    const double length = w.norm();
    if (length < 1e-9) return;  // the wrist in the shoulder: no arm folds onto itself
    const ChainJoint& elbow = chain_.joint(3);
    const Eigen::Vector3d forearm = wrist_ - elbow.point;
    const Eigen::Vector3d upper_arm = elbow.point - shoulder_;
    const double along = elbow.axis.dot(forearm);
    const Eigen::Vector3d across = forearm - along * elbow.axis;
    // |S -> W|^2 = |upper arm + R4 forearm|^2
    const double constant =
        upper_arm.squaredNorm() + forearm.squaredNorm() + 2.0 * along * upper_arm.dot(elbow.axis);
    const TrigRoots roots =
        trigRoots(2.0 * upper_arm.dot(across), 2.0 * upper_arm.dot(elbow.axis.cross(forearm)),
                  length * length - constant, constant);
    for (int i = 0; i < roots.count; ++i) {
      const CosSin& a = roots.root[static_cast<size_t>(i)];
      double q4 = a.angle();
      if (!fitToLimits(q4, elbow.lower, elbow.upper, options_.limit_tolerance_rad)) continue;
      const Eigen::Vector3d reach = upper_arm + turn(elbow.axis, a, forearm);
      solveArmAngle(T_base_tip, E.linear(), q4, rotationAbout(elbow.axis, a.c, a.s), reach, w, out);
    }
  }

 private:
  /// What all arm angles share.
  struct Elbow {
    double q4;
    Eigen::Vector3d to;        // from the shoulder towards the wrist, unit vector
    Eigen::Matrix3d R0, left;  // the upper arm's rotation at arm angle 0; the inverse of R0 R4
    double error_m;            // how far R0 leaves the wrist from its place
  };

  void solveArmAngle(const Eigen::Isometry3d& T, const Eigen::Matrix3d& R_end, double q4,
                     const Eigen::Matrix3d& R4, const Eigen::Vector3d& reach, const Eigen::Vector3d& w,
                     IkSolutions& out) const {
    Elbow elbow;
    elbow.q4 = q4;
    elbow.to = w.normalized();
    elbow.R0 = Eigen::Quaterniond::FromTwoVectors(reach, w).toRotationMatrix();
    elbow.left = (elbow.R0 * R4).transpose();
    elbow.error_m = (elbow.R0 * reach - w).norm();
    Breaks breaks;
    upper_breaks_.collect(Eigen::Matrix3d::Identity(), elbow.to, 1.0, elbow.R0, breaks);
    lower_breaks_.collect(elbow.left, elbow.to, -1.0, R_end, breaks);
    std::sort(breaks.angle.begin(), breaks.angle.begin() + breaks.count);
    if (breaks.count == 0) breaks.angle[static_cast<size_t>(breaks.count++)] = -M_PI;
    for (int i = 0; i < breaks.count; ++i) {
      const double begin = breaks.angle[static_cast<size_t>(i)];
      const bool last = i + 1 == breaks.count;
      const double end = last ? breaks.angle[0] + 2.0 * M_PI : breaks.angle[static_cast<size_t>(i + 1)];
      const int samples = std::max(1, static_cast<int>(std::ceil((end - begin) / options_.sweep_step_rad)));
      // Even at one sample an interval's middle decides for all of it; an interval without answers ends at
      // once.
      for (int k = 0; k < samples; ++k) {
        const int middle_first = k == 0 ? samples / 2 : (k <= samples / 2 ? k - 1 : k);
        const double psi = begin + (end - begin) * (middle_first + 0.5) / samples;
        if (!solveAt(T, R_end, elbow, psi, out)) break;
      }
    }
  }

  bool solveAt(const Eigen::Isometry3d& T, const Eigen::Matrix3d& R_end, const Elbow& elbow, double psi,
               IkSolutions& out) const {
    const Eigen::Matrix3d turned = rotationAbout(elbow.to, std::cos(psi), std::sin(psi));
    SphericalJoint::Solutions upper;
    upper_.solve(turned * elbow.R0, upper);
    if (upper.count == 0) return false;
    SphericalJoint::Solutions lower;
    lower_.solve(elbow.left * turned.transpose() * R_end, lower);
    for (int i = 0; i < upper.count; ++i) {
      for (int j = 0; j < lower.count; ++j) {
        emit(T, elbow, upper.item[static_cast<size_t>(i)], lower.item[static_cast<size_t>(j)], out);
      }
    }
    return lower.count > 0;
  }

  void emit(const Eigen::Isometry3d& T, const Elbow& elbow, const SphericalJoint::Solution& upper,
            const SphericalJoint::Solution& lower, IkSolutions& out) const {
    double q[7] = {upper.q[0], upper.q[1], upper.q[2], elbow.q4, lower.q[0], lower.q[1], lower.q[2]};
    // What the parts miss, seen at the tip.
    constexpr double kGood = 1e-9;
    const double turned = upper.error_rad + lower.error_rad;
    const double moved = elbow.error_m + turned * (T.translation() - shoulder_).norm() +
                         lower.error_rad * (chain_.zeroPose().translation() - wrist_).norm();
    if (turned < kGood && moved < kGood) {
      out.push(q);
    } else {
      accept(T, q, out);
    }
  }

  Eigen::Vector3d shoulder_, wrist_;
  Eigen::Isometry3d T_zero_inverse_;
  SphericalJoint upper_, lower_;
  TripleBreaks upper_breaks_, lower_breaks_;
};

}  // namespace

std::unique_ptr<IkSolver> makeShoulderElbowWrist7R(const SerialChain& chain, const IkOptions& options) {
  if (chain.dof() != 7 || !allRevolute(chain)) return nullptr;
  Eigen::Vector3d shoulder, wrist;
  if (!commonPoint(chain.joint(0), chain.joint(1), chain.joint(2), shoulder)) return nullptr;
  if (!commonPoint(chain.joint(4), chain.joint(5), chain.joint(6), wrist)) return nullptr;
  const ChainJoint& elbow = chain.joint(3);
  const bool bends = elbow.axis.cross(shoulder - elbow.point).norm() > 1e-4 &&
                     elbow.axis.cross(wrist - elbow.point).norm() > 1e-4;
  if (!bends) return nullptr;  // the elbow does not change the distance from shoulder to wrist
  return std::make_unique<ShoulderElbowWrist7R>(chain, options, shoulder, wrist);
}

}  // namespace fv_robot_model::ik
