/// Can the arm hold its tip at a point, looking along a direction?
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fv_robot_model/ik/group_solver.h"
#include "fv_robot_model/robot_model.h"
#include "fv_robot_model/self_collision.h"
#include "roll_search.h"
#include "tip_contact.h"

namespace capability_map {

struct ProbeOptions {
  double roll_step_rad{
      0.0872664626};  ///< Largest step between tried rolls about the tip's z [rad] (5 degrees).
  bool roll_search{
      true};  ///< Look between the steps where a limit was missed by little; false: the steps alone.
  bool self_collision{true};                ///< Refuse configurations in which the robot touches itself.
  double self_collision_padding_m{0.0};     ///< Links closer than twice that count as touching [m].
  double direction_tolerance_rad{0.0};      ///< Arms with fewer than 6 joints: how far z may miss [rad].
  double arm_angle_step_rad{0.0872664626};  ///< Step of redundant angles [rad].
};

/// What deciding cost.
struct ProbeCounts {
  int64_t ik_calls{0};
  int64_t collision_checks{0};
};

/// Decides views (tip position, direction of its z axis; roll free) by inverse kinematics and self-collision.
///
/// Roll: where the last joint turns about the tip's z, one IK call stands for all rolls; else the rolls are
/// tried coarse to fine until one holds (roll_search.h). Keeps buffers: one object per thread. The model must
/// outlive it.
class ViewProbe {
 public:
  /// @throws what chainOfGroup throws; std::invalid_argument for steps that are not positive.
  ViewProbe(const fv_robot_model::RobotModel& model, const std::string& group,
            const ProbeOptions& options = {});

  /// @param position Tip position in the group's base frame [m]. @param direction The tip's z, of any length
  ///        but 0. @throws std::invalid_argument as viewDirection().
  /// @param q_witness Room for dof() values: a configuration that holds the view, the one of largest
  ///        manipulability at the first roll that works.
  /// @return its manipulability, or a negative number when the view cannot be held.
  double decide(const Eigen::Vector3d& position, const Eigen::Vector3d& direction, double* q_witness);

  int dof() const { return solver_->chain().dof(); }
  const fv_robot_model::ik::IkSolver& solver() const { return *solver_; }
  bool lastJointRollsAboutZ() const { return roll_by_last_joint_; }
  const ProbeCounts& counts() const { return counts_; }
  void resetCounts() { counts_ = {}; }

 private:
  double decideByLastJoint(const Eigen::Isometry3d& T, double* q_witness);
  double searchRoll(const Eigen::Isometry3d& T, double* q_witness);
  double stepRoll(const Eigen::Isometry3d& T, double* q_witness);
  double solveWith(const fv_robot_model::ik::IkSolver& solver, const Eigen::Isometry3d& T, double* q_witness);
  double bestFree(fv_robot_model::ik::IkSolutions& solutions, double* q_witness);
  bool isFree(const double* q);
  bool freeAtSomeRoll(double* q);

  const fv_robot_model::RobotModel& model_;
  const fv_robot_model::Group& group_;
  ProbeOptions options_;
  std::unique_ptr<fv_robot_model::ik::IkSolver> solver_;  ///< With the real limits.
  /// Where the last joint rolls about z and one call decides: that joint unbounded.
  std::unique_ptr<fv_robot_model::ik::IkSolver> roll_solver_;
  /// Exact redundant arms: one solution per feasible interval first, it decides reachability and is cheap.
  std::unique_ptr<fv_robot_model::ik::IkSolver> one_per_interval_;
  /// Where rolls have to be searched.
  std::unique_ptr<RollSearch> roll_search_;
  std::unique_ptr<fv_robot_model::SelfCollision> collision_;
  std::unique_ptr<TipContact> tip_contact_;
  bool tip_contact_of_held_{false};
  bool roll_by_last_joint_{false};
  ProbeCounts counts_;
  fv_robot_model::ik::IkSolutions solutions_;
  Eigen::VectorXd q_all_;
  fv_robot_model::LinkPoses link_poses_;
  std::vector<std::pair<double, int>> ranking_;
};

}  // namespace capability_map
