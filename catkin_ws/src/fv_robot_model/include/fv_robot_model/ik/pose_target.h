/// Poses that count as reached within tolerances, for chains of any kind and any number of joints.
#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "fv_robot_model/ik/ik_solver.h"
#include "fv_robot_model/ik/serial_chain.h"

namespace fv_robot_model::ik {

/// What joint values must satisfy to count as reaching a pose.
struct PoseTarget {
  Eigen::Isometry3d T_base_tool{Eigen::Isometry3d::Identity()};  ///< Wanted pose in the chain's base frame.
  Eigen::Isometry3d T_tip_tool{Eigen::Isometry3d::Identity()};   ///< Tool frame on the chain's tip.
  bool free_roll{false};                                         ///< Any rotation about roll_axis will do.
  Eigen::Vector3d roll_axis{Eigen::Vector3d::UnitZ()};           ///< Unit vector, tool frame.
  double position_tolerance_m{0.005};                            ///< Positive.
  double angle_tolerance_rad{0.02};                              ///< Positive; of a free roll: of the axis.
};

/// What is left to go to a target, base frame.
struct PoseMiss {
  Eigen::Vector3d translation;  ///< [m]
  Eigen::Vector3d rotation;     ///< Rotation vector [rad]; with a free roll the shortest that turns the axis.
};
PoseMiss missOf(const PoseTarget& target, const Eigen::Isometry3d& T_base_tip);

/// Is the target reached, up to rounding (1e-6 m, 1e-6 rad)?
bool reaches(const PoseTarget& target, const Eigen::Isometry3d& T_base_tip);

/// Joint values that reach targets within their tolerances, found by descent from several starts.
///
/// First the least squares of both misses, each in units of its tolerance, by Levenberg and Marquardt's
/// method within the joint limits (joints that turn all the way round have none on the way). Where both
/// tolerances together are nearly kept, only what exceeds them is descended on: so that what one has to spare
/// is there for the other. A chain of fewer than six joints can hold next to no pose exactly, but one nearby.
/// Stateless: one object serves many threads.
class TolerantIk {
 public:
  /// @param iterations Steps of each descent at most. @throws std::invalid_argument unless positive.
  TolerantIk(SerialChain chain, int iterations);

  /// One descent from where q is, in place. @param q dof() values [rad or m].
  /// @return Is the target reached, with q within the limits? Else q is unspecified.
  bool descend(const PoseTarget& target, double* q) const;

  /// Descents from starts `first` to first + count - 1 of an endless sequence that fills the joint ranges
  /// evenly; start 0 is the middle of the ranges. Appends to out what differs from what is there, anywhere by
  /// more than 1e-3 rad or m.
  /// @param seed nullptr, or dof() values that take the place of the first start.
  void solve(const PoseTarget& target, const double* seed, int first, int count, IkSolutions& out) const;

  const SerialChain& chain() const { return chain_; }

 private:
  struct Descent;
  void start(int index, double* q) const;
  bool fit(double* q) const;

  SerialChain chain_;
  int iterations_;
  Eigen::VectorXd lower_, upper_;  ///< For the descent: infinite for joints that turn all the way round.
};

}  // namespace fv_robot_model::ik
