/// Every roll about the viewing axis at which an arm can hold a view: arms whose roll is not a joint of its
/// own.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "fv_robot_model/ik/ik_solver.h"

namespace capability_map {

/// How far the wrist can be from the shoulder, where one joint alone (the elbow) decides that: a roll that
/// asks for more or less than it allows has no solution, proven, and needs no inverse kinematics.
class ElbowBound {
 public:
  /// No bound when the chain has no such elbow.
  explicit ElbowBound(const fv_robot_model::ik::SerialChain& chain);

  /// The rolls of a view that the bound leaves, as cos(roll - middle) within [least, most].
  struct Rolls {
    double middle_cos{1.0}, middle_sin{0.0};
    double least{-2.0}, most{2.0};
    bool admits(double c, double s) const {
      const double cosine = c * middle_cos + s * middle_sin;
      return cosine >= least && cosine <= most;
    }
    bool none() const { return least > 1.0 || most < -1.0; }
  };
  /// @param T_base_tip The view at roll 0.
  Rolls rolls(const Eigen::Isometry3d& T_base_tip) const;

 private:
  bool bounded_{false};
  Eigen::Vector3d shoulder_{0.0, 0.0, 0.0};     ///< Base frame [m].
  Eigen::Vector3d p_tip_wrist_{0.0, 0.0, 0.0};  ///< Tip frame [m].
  double least_m2_{0.0}, most_m2_{0.0};         ///< Squared distance of the wrist from the shoulder.
};

struct RollSearchOptions {
  double roll_step_rad;  ///< Largest step between tried rolls.
  double hold_step_rad;  ///< Largest step of the redundant joint of a 7R arm.
  bool between_steps;    ///< Look between steps where a limit was missed by little; false: the steps alone.
};

/// For 6R arms with a closed form, and 7R arms that become one when a joint is held. Rolls (and values of the
/// held joint) are tried coarse to fine. Keeps buffers: one object per thread.
class RollSearch {
 public:
  using Solutions = fv_robot_model::ik::IkSolutions;
  /// Gets all solutions at one roll, (n, dof) of the whole chain; returns true to end the search.
  using Visitor = std::function<bool(Solutions&)>;
  /// Asked before inverse kinematics: the rolled pose of the tip, and the number of the held joint's value.
  using Filter = std::function<bool(const Eigen::Isometry3d&, size_t)>;

  /// nullptr when the chain is of another kind.
  /// @param held 7R: the joint to hold. @param held_values Its values; empty for 6R.
  static std::unique_ptr<RollSearch> make(const fv_robot_model::ik::SerialChain& chain,
                                          const fv_robot_model::ik::IkOptions& ik_options,
                                          const RollSearchOptions& options, bool last_joint_rolls);

  /// @param T_base_tip The view at roll 0. @return what the visitor returned last; false when nothing was
  /// found.
  bool search(const Eigen::Isometry3d& T_base_tip, const Filter& filter, const Visitor& visit);

  /// The values at which the last joint is held; empty when it never is.
  std::vector<double> heldValuesOfLastJoint() const;

  /// Calls of inverse kinematics so far.
  int64_t ikCalls() const { return ik_calls_; }

 private:
  struct Arm {  // the 6R arm that is left at one value of the held joint
    Arm(const fv_robot_model::ik::SerialChain& real, double held,
        const fv_robot_model::ik::IkOptions& ik_options, double slack);
    fv_robot_model::ik::SerialChain chain;                // with the real limits
    std::unique_ptr<fv_robot_model::ik::IkSolver> wider;  // with limits widened by the slack
    ElbowBound elbow;                                     // of the wider one
    double held;
  };
  struct Roll {
    double c, s, angle;
  };
  struct NearMiss {
    size_t arm;
    Roll roll;
    std::array<double, 6> q;
  };

  RollSearch(int dof, int held_joint, std::vector<Arm> arms, const RollSearchOptions& options);
  bool tryRoll(size_t arm, const Roll& roll, const Filter& filter, const Visitor& visit);
  bool tryNearMiss(NearMiss miss, const Visitor& visit);
  /// Takes over the found solution of the same branch, after joints should have moved by so much.
  bool follow(const Eigen::Matrix<double, 6, 1>& moved, NearMiss& miss) const;
  void solve(const Arm& arm, const Eigen::Isometry3d& T_base_tip);
  bool visitWithin(const Arm& arm, const Visitor& visit);

  int dof_;
  int held_joint_;  // -1: none
  std::vector<Arm> arms_;
  RollSearchOptions options_;
  std::vector<std::pair<uint32_t, Roll>> tries_;  // arm and roll, coarse to fine
  int64_t ik_calls_{0};
  Eigen::Isometry3d T_;
  std::vector<ElbowBound::Rolls> rolls_of_arm_;
  std::vector<NearMiss> near_misses_;
  Solutions found_, whole_;
};

}  // namespace capability_map
