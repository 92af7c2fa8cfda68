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
/// tried coarse to fine until one holds. Keeps buffers: one object per thread. The model must outlive it.
class ViewProbe {
 public:
  /// @throws what chainOfGroup throws; std::invalid_argument for steps that are not positive.
  ViewProbe(const fv_robot_model::RobotModel& model, const std::string& group,
            const ProbeOptions& options = {});

  /// @param position Tip position in the group's base frame [m]. @param direction Unit vector of the tip's z.
  /// @param q_witness Room for dof() values: a configuration that holds the view, the one of largest
  ///        manipulability at the first roll that works.
  /// @return its manipulability, or a negative number when the view cannot be held.
  double decide(const Eigen::Vector3d& position, const Eigen::Vector3d& direction, double* q_witness);

  /// Is the full pose held by some collision-free configuration? Otherwise as decide().
  double decidePose(const Eigen::Isometry3d& T_base_tip, double* q_witness);

  int dof() const { return solver_->chain().dof(); }
  const fv_robot_model::ik::IkSolver& solver() const { return *solver_; }
  bool lastJointRollsAboutZ() const { return roll_by_last_joint_; }
  const ProbeCounts& counts() const { return counts_; }
  void resetCounts() { counts_ = {}; }

 private:
  double decideFreeRoll(const Eigen::Isometry3d& T, double* q_witness);
  void holdLastJoint(const fv_robot_model::ik::SerialChain& chain,
                     const fv_robot_model::ik::IkOptions& options);
  void prepareRollSearch(const fv_robot_model::ik::SerialChain& chain,
                         const fv_robot_model::ik::IkOptions& options);
  double stepRoll(const Eigen::Isometry3d& T, double* q_witness);
  double searchRoll(const Eigen::Isometry3d& T, double* q_witness);
  double tryRoll(const Eigen::Isometry3d& T, double roll, double* q_witness);
  double solveHeld(const Eigen::Isometry3d& T, double* q_witness);
  double solveWith(const fv_robot_model::ik::IkSolver& solver, const Eigen::Isometry3d& T, double* q_witness);
  double bestFree(bool any_roll, double* q_witness);
  bool isFree(const double* q);
  bool freeAtSomeRoll(double* q);

  const fv_robot_model::RobotModel& model_;
  const fv_robot_model::Group& group_;
  ProbeOptions options_;
  std::unique_ptr<fv_robot_model::ik::IkSolver> solver_;  ///< With the real limits.
  /// Last joint unbounded where it rolls about z: decides all rolls at once.
  std::unique_ptr<fv_robot_model::ik::IkSolver> roll_solver_;
  /// Exact redundant arms: one solution per feasible interval first, it decides reachability and is cheap.
  std::unique_ptr<fv_robot_model::ik::IkSolver> one_per_interval_;
  /// Redundant arms without an exact solver whose last joint rolls about z: that joint held, rolls tried
  /// instead.
  std::unique_ptr<fv_robot_model::ik::IkSolver> held_solver_;
  double held_value_{0.0};
  fv_robot_model::ik::IkSolutions held_solutions_;
  /// 6 joints, roll not by the last one: limits widened, to see where a window between two rolls may hide.
  std::unique_ptr<fv_robot_model::ik::IkSolver> wider_solver_;
  Eigen::Vector3d shoulder_{0.0, 0.0, 0.0};     ///< Base frame [m].
  Eigen::Vector3d p_tip_wrist_{0.0, 0.0, 0.0};  ///< Where the last two axes are nearest, tip frame [m].
  std::vector<double> near_misses_;
  std::unique_ptr<fv_robot_model::SelfCollision> collision_;
  bool roll_by_last_joint_{false};
  std::vector<double> rolls_;  ///< Coarse to fine [rad].
  ProbeCounts counts_;
  fv_robot_model::ik::IkSolutions solutions_;
  Eigen::VectorXd q_all_;
  fv_robot_model::LinkPoses link_poses_;
  std::vector<std::pair<double, int>> ranking_;
};

}  // namespace capability_map
