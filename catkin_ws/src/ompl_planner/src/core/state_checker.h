/// Is a joint state of the group allowed? World and robot together.
#pragma once

#include <fv_robot_model/robot_model.h>
#include <fv_robot_model/self_collision.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fast_collision.h"
#include "ompl_planner/time_parameterization.h"
#include "world_collision.h"

namespace ompl_planner {

/// What keeps a state from being allowed.
struct Blockage {
  enum class By { Nothing, Obstacle, UnknownSpace, Robot };
  By by{By::Nothing};
  std::string text;  ///< Link and voxel, or both links; empty when nothing blocks.
};

/// Checks states, edges and trajectories of one group; the other joints stay where the start has them. Holds
/// buffers: one object per thread.
class StateChecker {
 public:
  /// @param q_all Values of all joints; those of the group are replaced by each checked state.
  /// @param self  May be null: then the robot is not checked against itself.
  /// @param fast  May be null; else it answers in place of `world`, which it wraps.
  StateChecker(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
               const Eigen::VectorXd& q_all, std::shared_ptr<const WorldCollision> world,
               std::shared_ptr<const fv_robot_model::SelfCollision> self, double joint_step_rad,
               std::shared_ptr<const WorldCheck> fast = nullptr);

  bool valid(const JointVector& q) const;
  /// What is hit first at q.
  Blockage blockageAt(const JointVector& q) const;
  /// Its text; empty when nothing is hit.
  std::string whyInvalid(const JointVector& q) const { return blockageAt(q).text; }
  /// Are all states of the straight line free, at steps of joint_step_rad or less? The ends are not asked.
  bool edgeValid(const JointVector& from, const JointVector& to) const {
    return edgeValid(from, to, joint_step_);
  }
  bool edgeValid(const JointVector& from, const JointVector& to, double joint_step_rad) const;

  /// T_root_link of all links at q; valid until the next call of any member.
  const fv_robot_model::LinkPoses& posesAt(const JointVector& q) const;

  /// Forgives links that come closer to each other than their padding at the start: such pairs may stay
  /// close, but not touch. Controllers do not track exactly, so a plan's end may be a little closer than the
  /// plan.
  /// @param bare The self check without padding.
  void allowClosePairs(std::shared_ptr<const fv_robot_model::SelfCollision> bare,
                       const std::vector<fv_robot_model::LinkPair>& pairs);

  /// Number of states checked so far.
  std::size_t checks() const { return checks_; }

 private:
  std::optional<fv_robot_model::LinkPair> selfContact(const fv_robot_model::LinkPoses& poses) const;

  const fv_robot_model::RobotModel& model_;
  const fv_robot_model::Group& group_;
  std::shared_ptr<const WorldCollision> world_;
  std::shared_ptr<const fv_robot_model::SelfCollision> self_;
  double joint_step_;
  std::shared_ptr<const WorldCheck> fast_;
  std::shared_ptr<const fv_robot_model::SelfCollision> bare_self_;
  std::vector<fv_robot_model::LinkPair> close_pairs_;
  mutable Eigen::VectorXd q_all_;
  mutable fv_robot_model::LinkPoses poses_;
  mutable std::size_t checks_{0};
};

/// The first forbidden state of a trajectory from from_s [s] on, at joint steps of step_rad or less, in the
/// words of the checker; empty when all are free.
std::string firstForbidden(const TimedTrajectory& trajectory, const StateChecker& checker, double step_rad,
                           double from_s = 0.0);

}  // namespace ompl_planner
