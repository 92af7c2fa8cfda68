/// The whole pipeline: goals, search, shortcuts, corners, timing, judge.
#pragma once

#include <fv_robot_model/robot_model.h>
#include <fv_robot_model/self_collision.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "ompl_planner/config.h"
#include "ompl_planner/plan_types.h"
#include "ompl_planner/prepared_world.h"

namespace ompl_planner {

/// Velocity and acceleration limit of a joint; 0 where none is given.
struct JointRates {
  double velocity{0.0};      ///< [rad/s]
  double acceleration{0.0};  ///< [rad/s^2]
};

/// Called when a stage of planning begins: "goals", "search", "shortcut", "timing", "judge".
using StageCallback = std::function<void(const std::string&)>;

/// Plans collision-free, timed motions of any group of one robot. Keeps nothing of a request but the
/// distance field of its map, which changes no answer; one call of solve at a time
/// in a process (see findPath).
class MotionPlanner {
 public:
  /// @param rates By joint; where a joint or a value is missing, the URDF's velocity and then the configured
  /// defaults.
  /// @throws std::invalid_argument for a configuration out of range or an unknown planner.
  MotionPlanner(std::shared_ptr<const fv_robot_model::RobotModel> model,
                const std::map<std::string, JointRates>& rates, const PlannerConfig& config);

  const PlannerConfig& config() const { return config_; }
  const fv_robot_model::RobotModel& model() const { return *model_; }
  bool knowsGroup(const std::string& name) const { return self_.count(name) != 0; }

  /// Everything that can go wrong with a plan is a status of the result, with a message that says why;
  /// nothing is thrown. Equal requests give equal results unless time ran out or somebody cancelled.
  PlanResult solve(const PlanRequest& request, const std::atomic<bool>* cancel = nullptr,
                   const StageCallback& on_stage = {}) const;

  /// The first state of a trajectory from start_time_s on that the map or the robot itself forbids, at joint
  /// steps of joint_step_rad or less; empty when all are free. The allowance for the start is taken at the
  /// trajectory's begin.
  /// @param request Its group, start, map, transform and unknown-space policy are used.
  std::string judge(const PlanRequest& request, const TimedTrajectory& trajectory,
                    double start_time_s = 0.0) const;

  /// Builds what a request on this map will need, so that it does not wait for it. Uses the request's group,
  /// start, map, transform and unknown-space policy. @throws as RobotModel::group for an unknown group.
  void warm(const PlanRequest& request) const;

  /// Box in the map frame that no link can leave, whatever the joints do [m].
  Eigen::AlignedBox3d reach(const Eigen::Isometry3d& T_map_root) const;

 private:
  struct Job;
  void run(Job& job) const;
  bool prepareStart(Job& job) const;
  bool collectGoals(Job& job) const;
  std::optional<JointPath> straightPath(const Job& job) const;
  bool search(Job& job) const;
  bool shorten(Job& job) const;
  bool timeAndJudge(Job& job) const;
  MotionLimits limitsOf(const fv_robot_model::Group& group) const;

  std::shared_ptr<const fv_robot_model::RobotModel> model_;
  std::map<std::string, JointRates> rates_;
  PlannerConfig config_;
  std::shared_ptr<WorldMemory> worlds_;
  std::map<std::string, std::shared_ptr<const fv_robot_model::SelfCollision>> self_;  ///< By group.
  std::map<std::string, std::shared_ptr<const fv_robot_model::SelfCollision>>
      bare_self_;  ///< Without padding.
};

}  // namespace ompl_planner
