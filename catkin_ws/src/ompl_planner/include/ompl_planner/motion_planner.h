/// The whole pipeline: goals, search, shortcuts, corners, timing, judge.
#pragma once

#include <fv_robot_model/ik/ik_solver.h>
#include <fv_robot_model/robot_model.h>
#include <fv_robot_model/self_collision.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ompl_planner/config.h"
#include "ompl_planner/plan_types.h"

namespace ompl_planner {

class RoadmapMemory;
struct SearchProblem;
class WorldMemory;

/// Velocity and acceleration limit of a joint; 0 where none is given.
struct JointRates {
  double velocity{0.0};      ///< [rad/s]
  double acceleration{0.0};  ///< [rad/s^2]
};

/// Something that the robot holds: it becomes a link of its own.
struct HeldObject {
  std::string name;
  std::string link;                      ///< That holds it; the two may touch.
  std::vector<std::string> touch_links;  ///< Others that may touch it.
  fv_robot_model::Shape shape;           ///< T_link_shape in the frame of `link`.
};

/// Called when a stage of planning begins: "goals", "search", "shortcut", "timing", "judge".
using StageCallback = std::function<void(const std::string&)>;

/// Plans collision-free, timed motions of any group of one robot. Keeps nothing of a request but the
/// distance field of its map, which changes no answer, and the roadmaps of planners that have some, which
/// may (see RoadmapMemory); one call of solve at a time in a process (see findPath).
class MotionPlanner {
 public:
  /// @param rates By joint; where a joint or a value is missing, the URDF's velocity and then the configured
  /// defaults.
  /// @throws std::invalid_argument for a configuration out of range or an unknown planner.
  MotionPlanner(std::shared_ptr<const fv_robot_model::RobotModel> model,
                const std::map<std::string, JointRates>& rates, const PlannerConfig& config);

  /// The planner of the same robot holding these objects as well.
  /// @throws std::invalid_argument (UnknownNameError) for a name that is taken or a link that does not exist.
  std::shared_ptr<const MotionPlanner> holding(const std::vector<HeldObject>& objects) const;

  const PlannerConfig& config() const { return config_; }
  const fv_robot_model::RobotModel& model() const { return *model_; }
  bool knowsGroup(const std::string& name) const { return self_.count(name) != 0; }

  /// Everything that can go wrong with a plan is a status of the result, with a message that says why;
  /// nothing is thrown. Equal requests give equal results unless time ran out, somebody cancelled, or the
  /// planner keeps roadmaps.
  PlanResult solve(const PlanRequest& request, const std::function<bool()>& cancelled = {},
                   const StageCallback& on_stage = {}) const;

  /// The first state of a trajectory from start_time_s on that the map or the robot itself forbids, at joint
  /// steps of joint_step_rad or less; empty when all are free. The allowance for the start is taken at the
  /// trajectory's begin.
  /// @param request Its group, start, map, transform and unknown-space policy are used.
  std::string judge(const PlanRequest& request, const TimedTrajectory& trajectory,
                    double start_time_s = 0.0) const;

  /// The first point of a trajectory that the joints' limits forbid: a position by more than
  /// limit_tolerance_rad, a velocity or an acceleration by more than 1 %; empty when there is none.
  std::string beyondLimits(const fv_robot_model::Group& group, const TimedTrajectory& trajectory) const;

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
  SearchProblem searchProblem(Job& job) const;
  std::optional<JointPath> plannedPath(Job& job, const std::string& planner) const;
  bool shorten(Job& job) const;
  void shortenDetour(Job& job) const;
  const std::string& plannerOf(const PlanRequest& request) const;
  void noteGoal(Job& job) const;
  bool timeAndJudge(Job& job) const;
  double clearanceAlong(const Job& job) const;
  std::shared_ptr<const fv_robot_model::ik::IkSolver> ikOf(const PlanRequest& request,
                                                           const fv_robot_model::Group& group) const;
  MotionLimits limitsOf(const fv_robot_model::Group& group) const;

  std::shared_ptr<const fv_robot_model::RobotModel> model_;
  std::map<std::string, JointRates> rates_;
  PlannerConfig config_;
  std::shared_ptr<WorldMemory> worlds_;
  std::map<std::string, std::shared_ptr<const fv_robot_model::SelfCollision>> self_;  ///< By group.
  std::map<std::string, std::shared_ptr<const fv_robot_model::SelfCollision>>
      search_self_;  ///< With the search's margin.
  std::map<std::string, std::shared_ptr<const fv_robot_model::SelfCollision>>
      bare_self_;  ///< Without padding.
  mutable std::mutex ik_mutex_;
  mutable std::map<std::string, std::pair<double, std::shared_ptr<const fv_robot_model::ik::IkSolver>>>
      ik_;  ///< By group: the angle tolerance it was made for, and the solver.
  mutable std::mutex roadmaps_mutex_;
  std::shared_ptr<RoadmapMemory> roadmaps_;
};

}  // namespace ompl_planner
