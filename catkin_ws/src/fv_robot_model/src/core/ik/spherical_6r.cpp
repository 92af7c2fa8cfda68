// 6R with three consecutive axes through one point, at the wrist or at the shoulder.
//
// The point W in which the last three axes meet is carried by the first three alone: a position problem with
// at most four answers. The rotation that is then missing is made by the last three: two answers each. An arm
// whose shoulder is spherical is the same arm seen from its tip: its inverse motion is a chain with the
// joints in reverse order and negated axes.

#include <array>
#include <sstream>

#include "position_3r.h"
#include "solvers.h"
#include "spherical_joint.h"

namespace fv_robot_model::ik {

namespace {

class Spherical6R : public IkSolver {
 public:
  Spherical6R(const SerialChain& chain, const IkOptions& options, const std::array<ChainJoint, 6>& ordered,
              const Eigen::Vector3d& center, bool reversed)
      : IkSolver(chain, options),
        reversed_(reversed),
        center_(center),
        T_zero_inverse_(chain.zeroPose().inverse()),
        position_({ordered[0], ordered[1], ordered[2]}, center, options.limit_tolerance_rad),
        wrist_({ordered[3], ordered[4], ordered[5]}, options.limit_tolerance_rad) {}

  bool solvable() const { return position_.solvable(); }
  bool exact() const override { return true; }
  std::string family() const override { return reversed_ ? "spherical-shoulder-6R" : "spherical-wrist-6R"; }
  std::string name() const override {
    std::ostringstream text;
    const int at = reversed_ ? 0 : 3;
    text << family() << ": closed form, because the axes of " << chain_.joint(at).name << ", "
         << chain_.joint(at + 1).name << " and " << chain_.joint(at + 2).name << " meet in one point";
    return text.str();
  }

  void solvePose(const Eigen::Isometry3d& T_base_tip, const double* /*seed*/,
                 IkSolutions& out) const override {
    const Eigen::Isometry3d motion = T_base_tip * T_zero_inverse_;
    const Eigen::Isometry3d E = reversed_ ? motion.inverse() : motion;
    Position3R::Solutions arms;
    position_.solve(E * center_, arms);
    SphericalJoint::Solutions wrists;
    for (int i = 0; i < arms.count; ++i) {
      const Position3R::Solution& arm = arms.item[static_cast<size_t>(i)];
      wrist_.solve(position_.remaining(arm, E.linear()), wrists);
      double q[3];
      if (wrists.count == 0 || !position_.angles(arm, q)) continue;
      for (int j = 0; j < wrists.count; ++j)
        emit(T_base_tip, arm.error_m, q, wrists.item[static_cast<size_t>(j)], out);
    }
  }

 private:
  void emit(const Eigen::Isometry3d& T_base_tip, double error_m, const double* arm,
            const SphericalJoint::Solution& wrist, IkSolutions& out) const {
    double q[6];
    for (size_t k = 0; k < 3; ++k) {
      q[reversed_ ? 5 - k : k] = arm[k];
      q[reversed_ ? 2 - k : 3 + k] = wrist.q[k];
    }
    // What the subproblems miss, seen at the tip: far below any tolerance but next to singular positions.
    constexpr double kGood = 1e-9;
    const Eigen::Vector3d tip = reversed_ ? T_base_tip.translation() : chain_.zeroPose().translation();
    if (error_m + (tip - center_).norm() * wrist.error_rad < kGood && wrist.error_rad < kGood) {
      out.push(q);
    } else {
      accept(T_base_tip, q, out);
    }
  }

  bool reversed_;
  Eigen::Vector3d center_;
  Eigen::Isometry3d T_zero_inverse_;
  Position3R position_;
  SphericalJoint wrist_;
};

/// The joints as the solver meets them: as they are, or from the tip with negated axes (e^{-Sq} about S).
std::array<ChainJoint, 6> orderedJoints(const SerialChain& chain, bool reversed) {
  std::array<ChainJoint, 6> joints;
  for (int i = 0; i < 6; ++i) {
    joints[static_cast<size_t>(i)] = chain.joint(reversed ? 5 - i : i);
    if (reversed) joints[static_cast<size_t>(i)].axis *= -1.0;
  }
  return joints;
}

}  // namespace

bool allRevolute(const SerialChain& chain) {
  for (const ChainJoint& joint : chain.joints()) {
    if (joint.prismatic) return false;
  }
  return true;
}

bool commonPoint(const ChainJoint& a, const ChainJoint& b, const ChainJoint& c, Eigen::Vector3d& point) {
  // Least squares of the distances from the lines: sum (I - h h^T)(x - r) = 0.
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (const ChainJoint* line : {&a, &b, &c}) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - line->axis * line->axis.transpose();
    A += across;
    rhs += across * line->point;
  }
  if (A.determinant() < 1e-6) return false;  // all parallel
  point = A.ldlt().solve(rhs);
  for (const ChainJoint* line : {&a, &b, &c}) {
    if (line->axis.cross(point - line->point).norm() > 1e-6) return false;
  }
  // Neighbours must differ, or two joints are one.
  return a.axis.cross(b.axis).norm() > 1e-4 && b.axis.cross(c.axis).norm() > 1e-4;
}

std::unique_ptr<IkSolver> makeSpherical6R(const SerialChain& chain, const IkOptions& options) {
  if (chain.dof() != 6 || !allRevolute(chain)) return nullptr;
  for (const bool reversed : {false, true}) {
    const auto joints = orderedJoints(chain, reversed);
    Eigen::Vector3d center;
    if (!commonPoint(joints[3], joints[4], joints[5], center)) continue;
    auto solver = std::make_unique<Spherical6R>(chain, options, joints, center, reversed);
    if (solver->solvable()) return solver;
  }
  return nullptr;
}

}  // namespace fv_robot_model::ik
