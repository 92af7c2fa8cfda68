#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace fv_robot_model::ik {

/// One moving joint of a chain, described at the chain's zero configuration (product of exponentials).
struct ChainJoint {
  std::string name;
  Eigen::Vector3d axis{0.0, 0.0, 1.0};   ///< Unit vector, base frame.
  Eigen::Vector3d point{0.0, 0.0, 0.0};  ///< Any point of the axis, base frame [m].
  double lower{0.0};                     ///< [rad] or [m]
  double upper{0.0};                     ///< [rad] or [m]
  bool prismatic{false};
};

/// An axis of a chain whose joints have mimics: it moves by multiplier times the value of one of the joints.
/// A mimic's offset is part of the chain's zero configuration.
struct CoupledAxis {
  ChainJoint axis;  ///< Its limits are not used: those of the joint cover them.
  int joint{0};     ///< Place of the joint that moves it.
  double multiplier{1.0};
};

/// A serial chain from a base frame to a tip frame: T_base_tip(q) = e^{S1 q1} ... e^{Sn qn} T_base_tip(0).
class SerialChain {
 public:
  /// @throws std::invalid_argument when there is no joint, an axis is no unit vector, a number is not finite
  ///         or a joint has lower > upper; the message names the joint.
  SerialChain(std::vector<ChainJoint> joints, const Eigen::Isometry3d& T_base_tip_zero,
              std::string base_frame = "base", std::string tip_frame = "tip");

  /// A chain with mimic joints. @param axes All of its axes, base first: those of the joints themselves and
  /// those of their mimics.
  SerialChain(std::vector<ChainJoint> joints, std::vector<CoupledAxis> axes,
              const Eigen::Isometry3d& T_base_tip_zero, std::string base_frame = "base",
              std::string tip_frame = "tip");

  /// True when a joint moves more than its own axis: then there are no closed forms.
  bool isCoupled() const { return !coupled_axes_.empty(); }
  /// Every axis, base first; of an ordinary chain one a joint.
  std::vector<CoupledAxis> axes() const;

  int dof() const { return static_cast<int>(joints_.size()); }
  const std::vector<ChainJoint>& joints() const { return joints_; }
  const ChainJoint& joint(int i) const { return joints_[static_cast<size_t>(i)]; }
  const Eigen::Isometry3d& zeroPose() const { return T_base_tip_zero_; }
  const std::string& baseFrame() const { return base_frame_; }
  const std::string& tipFrame() const { return tip_frame_; }

  /// Tip pose in the base frame. @param q dof() joint values.
  Eigen::Isometry3d forward(const double* q) const;

  /// Geometric Jacobian at the tip's origin, base frame: rows 0-2 linear, rows 3-5 angular; (6, dof).
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(const double* q) const;

  /// Yoshikawa's manipulability sqrt(det(J J^T)); for dof < 6 sqrt(det(J^T J)). Unit mixed (m, rad).
  double manipulability(const double* q) const;

  /// The same chain with joint i held at value: joint i is gone, what follows it has moved along.
  /// @throws std::invalid_argument for a chain with mimic joints.
  SerialChain withFixedJoint(int i, double value) const;

  /// The same chain with other limits of joint i.
  SerialChain withLimits(int i, double lower, double upper) const;

  /// True when q is within the limits, up to tolerance [rad or m].
  bool withinLimits(const double* q, double tolerance) const;

 private:
  Eigen::Matrix<double, 6, Eigen::Dynamic> coupledJacobian(const double* q) const;

  std::vector<ChainJoint> joints_;
  std::vector<CoupledAxis> coupled_axes_;  ///< Empty for an ordinary chain.
  Eigen::Isometry3d T_base_tip_zero_;
  std::string base_frame_;
  std::string tip_frame_;
};

/// A bound on how far the tip can be from a fixed point: |tip(q) - center| <= radius for every q.
struct ReachBound {
  Eigen::Vector3d center;  ///< A point of the first axis, base frame [m].
  double radius_m;
};

/// The shortest polyline that visits the axes in order and ends at the tip: each of its pieces keeps its
/// length when the joints turn, so by the triangle inequality the tip never leaves the ball. Prismatic joints
/// add their stroke. With three axes meeting in a shoulder the first point is the shoulder.
ReachBound reachBound(const SerialChain& chain);

/// The rotation by the angle with cosine c and sine s about the unit axis h.
Eigen::Matrix3d rotationAbout(const Eigen::Vector3d& h, double c, double s);

/// The displacement of everything behind a joint that moves by q.
Eigen::Isometry3d jointMotion(const ChainJoint& joint, double q);

}  // namespace fv_robot_model::ik
