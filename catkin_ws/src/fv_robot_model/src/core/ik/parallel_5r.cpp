// 5R whose axes 2, 3 and 4 are parallel (KUKA youBot): a turning plane with a planar 3R arm in it, and a last
// joint.
//
// Five joints hold a position and one angle less than a direction: an arbitrary pose is out of reach by
// nature. With direction_tolerance_rad > 0 the direction of the last axis may be turned, about the tip, into
// the plane that the arm can use; the returned solution reproduces the turned pose.

#include <cmath>
#include <sstream>

#include "solvers.h"
#include "subproblems.h"

namespace fv_robot_model::ik {

namespace {

class Parallel5R : public IkSolver {
 public:
  Parallel5R(const SerialChain& chain, const IkOptions& options)
      : IkSolver(chain, options),
        T_zero_inverse_(chain.zeroPose().inverse()),
        tip_(chain.zeroPose().translation()),
        n_(chain.joint(1).axis),
        h1_(chain.joint(0).axis),
        h5_(chain.joint(4).axis),
        r1_(chain.joint(0).point),
        r5_(chain.joint(4).point + h5_ * h5_.dot(tip_ - chain.joint(4).point)) {
    scale_ = std::max(1e-3, (r5_ - r1_).norm() + (tip_ - r5_).norm());
    for (int i = 0; i < 3; ++i) sign_[i] = chain.joint(1 + i).axis.dot(n_) > 0.0 ? 1.0 : -1.0;
  }

  bool exact() const override { return true; }
  std::string family() const override { return "parallel-5R"; }
  std::string name() const override {
    std::ostringstream text;
    text << family() << ": closed form, because the axes of " << chain_.joint(1).name << ", "
         << chain_.joint(2).name << " and " << chain_.joint(3).name
         << " are parallel; the direction may miss by " << options_.direction_tolerance_rad * 180.0 / M_PI
         << " degrees";
    return text.str();
  }

  void solvePose(const Eigen::Isometry3d& T_base_tip, const double* /*seed*/,
                 IkSolutions& out) const override {
    const Eigen::Isometry3d E = T_base_tip * T_zero_inverse_;
    // The plane of joints 2 to 4 keeps its distance from the base: (R1 n) . (r5' - r1) = n . (r5 - r1).
    TrigRoots first = rootsOfFirst(E * r5_ - r1_, n_.dot(r5_ - r1_), scale_);
    if (first.any_angle)
      first = rootsOfFirst(E.linear() * h5_, n_.dot(h5_), 1.0);  // the wrist is over axis 1
    if (first.any_angle) first = middleOfFirst();
    for (int i = 0; i < first.count; ++i) {
      solveFirst(T_base_tip, first.root[static_cast<size_t>(i)], out);
    }
  }

 private:
  /// Angles of joint 1 with (R1 n) . v = value.
  TrigRoots rootsOfFirst(const Eigen::Vector3d& v, double value, double scale) const {
    const double constant = h1_.dot(n_) * h1_.dot(v);
    return trigRoots(n_.dot(v) - constant, v.dot(h1_.cross(n_)), value - constant, scale);
  }

  TrigRoots middleOfFirst() const {
    TrigRoots roots;
    roots.root[0] = cosSin(0.5 * (chain_.joint(0).lower + chain_.joint(0).upper));
    roots.count = 1;
    return roots;
  }

  /// The pose turned about the tip until the last axis lies as the arm's plane wants it.
  /// @return false when that takes more than the tolerance.
  bool turnIntoPlane(const Eigen::Vector3d& normal, Eigen::Isometry3d& T) const {
    const Eigen::Vector3d d = (T.linear() * chain_.zeroPose().linear().transpose()) * h5_;
    const double along = n_.dot(h5_);
    const Eigen::Vector3d flat = d - normal.dot(d) * normal;
    if (flat.norm() < 1e-9) return false;
    const Eigen::Vector3d wanted =
        along * normal + std::sqrt(std::max(0.0, 1.0 - along * along)) * flat.normalized();
    const double angle = std::atan2(d.cross(wanted).norm(), d.dot(wanted));
    if (angle > options_.direction_tolerance_rad + options_.angle_tolerance_rad) return false;
    if (angle > 0.0)
      T.linear() = Eigen::Quaterniond::FromTwoVectors(d, wanted).toRotationMatrix() * T.linear();
    return true;
  }

  void solveFirst(const Eigen::Isometry3d& T_base_tip, CosSin first, IkSolutions& out) const {
    Eigen::Isometry3d T = T_base_tip;
    if (options_.direction_tolerance_rad > 0.0 && !turnIntoPlane(turn(h1_, first, n_), T)) return;
    double q1 = first.angle();
    if (!fitToLimits(q1, chain_.joint(0).lower, chain_.joint(0).upper, options_.limit_tolerance_rad)) return;
    const CosSin back{first.c, -first.s};
    const Eigen::Isometry3d E = T * T_zero_inverse_;
    const AlignedAngle pitch = alignAbout(n_, h5_, turn(h1_, back, E.linear() * h5_), 1.0);
    if (pitch.any_angle) return;  // the last axis is parallel to the others: a joint too many
    // Where axis 4 must go: e2 e3 r4 = e1^-1 E r5 - R(n, sigma)(r5 - r4).
    const Eigen::Vector3d r4 = chain_.joint(3).point;
    const Eigen::Vector3d carried = r1_ + turn(h1_, back, E * r5_ - r1_);
    planar(T, q1, first, pitch.angle, carried - turn(n_, pitch.angle, r5_ - r4), out);
  }

  /// Joints 2 and 3 bring axis 4 to a place, in the plane across n; joint 4 makes up the angle.
  void planar(const Eigen::Isometry3d& T, double q1, const CosSin& first, const CosSin& pitch,
              const Eigen::Vector3d& place, IkSolutions& out) const {
    const auto flat = [this](const Eigen::Vector3d& v) { return Eigen::Vector3d(v - n_.dot(v) * n_); };
    const Eigen::Vector3d a = flat(chain_.joint(2).point - chain_.joint(1).point);
    const Eigen::Vector3d b = flat(chain_.joint(3).point - chain_.joint(2).point);
    const Eigen::Vector3d target = flat(place - chain_.joint(1).point);
    const TrigRoots bend =
        trigRoots(2.0 * a.dot(b), 2.0 * a.dot(n_.cross(b)),
                  target.squaredNorm() - a.squaredNorm() - b.squaredNorm(), scale_ * scale_);
    for (int i = 0; i < bend.count; ++i) {
      const CosSin& third = bend.root[static_cast<size_t>(i)];
      const AlignedAngle second = alignAbout(n_, a + turn(n_, third, b), target, scale_);
      if (second.any_angle) continue;
      const double about2 = second.angle.angle();
      const double about3 = third.angle();
      const double about4 = pitch.angle() - about2 - about3;
      double q[5] = {q1, sign_[0] * about2, sign_[1] * about3, sign_[2] * about4, 0.0};
      const Eigen::Matrix3d R = rotationAbout(h1_, first.c, first.s) * rotationAbout(n_, pitch.c, pitch.s);
      const Eigen::Vector3d across = h5_.unitOrthogonal();
      const Eigen::Vector3d turned = R.transpose() * (T * T_zero_inverse_).linear() * across;
      q[4] = alignAbout(h5_, across, turned, 1.0).angle.angle();
      if (fitAll(q)) accept(T, q, out);
    }
  }

  bool fitAll(double* q) const {
    for (int k = 1; k < 5; ++k) {
      const ChainJoint& joint = chain_.joint(k);
      if (!fitToLimits(q[k], joint.lower, joint.upper, options_.limit_tolerance_rad)) return false;
    }
    return true;
  }

  Eigen::Isometry3d T_zero_inverse_;
  Eigen::Vector3d tip_, n_, h1_, h5_, r1_, r5_;
  double scale_{1.0};
  double sign_[3];
};

}  // namespace

std::unique_ptr<IkSolver> makeParallel5R(const SerialChain& chain, const IkOptions& options) {
  if (chain.dof() != 5 || !allRevolute(chain)) return nullptr;
  const Eigen::Vector3d n = chain.joint(1).axis;
  const bool parallel =
      n.cross(chain.joint(2).axis).norm() < 1e-7 && n.cross(chain.joint(3).axis).norm() < 1e-7;
  const bool skew = n.cross(chain.joint(0).axis).norm() > 1e-4 && n.cross(chain.joint(4).axis).norm() > 1e-4;
  if (!parallel || !skew) return nullptr;
  // With a tolerance the pose is turned about the tip: the plane must not move then, so the tip must be on
  // axis 5.
  const ChainJoint& last = chain.joint(4);
  const bool on_axis = last.axis.cross(chain.zeroPose().translation() - last.point).norm() < 1e-6;
  if (options.direction_tolerance_rad > 0.0 && !on_axis) return nullptr;
  return std::make_unique<Parallel5R>(chain, options);
}

}  // namespace fv_robot_model::ik
