#include "execution.h"

#include <fv_msgs/PlannedPath.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "conversions.h"
#include "ompl_planner/trajectory_watch.h"
#include "ros_stopwatch.h"

namespace ompl_planner {
namespace {

using Result = fv_msgs::ExecuteMotionResult;

constexpr double kStartToleranceRad = 0.1;  // a trajectory must begin where the robot is
constexpr double kFeedbackPeriodS = 0.05;

void pause() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

}  // namespace

/// One goal and what belongs to it.
struct Execution::Motion {
  const fv_msgs::ExecuteMotionGoal& goal;
  std::function<bool()> cancelled;
  std::function<void(double)> on_fraction;
  std::shared_ptr<const MotionPlanner> planner;
  ControllerSet controllers;
  TimedTrajectory trajectory{};
  fv_robot_model::Group group{};
  Eigen::VectorXd q_all{};
  Result result{};
  std::optional<PlacedMap> planned_on{};  ///< Empty: maps are not checked.
  std::uint64_t checked_sequence{0};      ///< The newest map that was found harmless.

  bool end(std::uint8_t status, const std::string& message) {
    result.status = status;
    result.message = message;
    return false;
  }
};

Execution::Execution(ros::NodeHandle& nh, const CurrentPlanner& planner, const RobotState& state,
                     MapKeeper& maps, const NodeParams& params)
    : planner_(planner),
      state_(state),
      maps_(maps),
      config_(params.node),
      controllers_(params.controllers),
      path_publisher_(nh.advertise<fv_msgs::PlannedPath>("/ompl_planner/path", 1, /*latch=*/true)) {}

Result Execution::execute(const fv_msgs::ExecuteMotionGoal& goal, const std::function<bool()>& cancelled,
                          const std::function<void(double)>& on_fraction) {
  const Turns::Turn turn(turns_);
  const auto stop = [&] { return cancelled() || turn.replaced() || !ros::ok(); };
  Motion motion{goal, stop, on_fraction, planner_.get(), ControllerSet(controllers_)};
  try {
    run(motion);
  } catch (const std::exception& error) {
    motion.end(Result::INVALID_REQUEST, error.what());
    this->stop(motion);
  }
  motion.result.max_tracking_error = motion.controllers.maxTrackingError();
  return motion.result;
}

void Execution::run(Motion& motion) {
  if (!prepare(motion)) return;
  std::string why;
  if (!motion.controllers.connect(config_.controller_wait_s, motion.cancelled, why)) {
    motion.end(motion.cancelled() ? Result::CANCELLED : Result::CONTROLLER_FAILED, why);
    return;
  }
  if (!mapAllows(motion)) return;
  publishPath(motion);
  motion.controllers.send();
  watch(motion);
}

bool Execution::prepare(Motion& motion) {
  motion.trajectory = trajectoryFromMsg(motion.goal.trajectory);
  if (motion.trajectory.times.empty())
    return motion.end(Result::INVALID_REQUEST, "the trajectory has no points");
  motion.group = groupOfJoints(motion.planner->model(), motion.goal.trajectory.joint_names);
  motion.controllers.assign(motion.goal.trajectory);
  std::string why;
  const auto q_all = state_.joints(motion.planner->model().jointNames(), why);
  if (!q_all) return motion.end(Result::INVALID_REQUEST, why);
  motion.q_all = *q_all;
  return startsWhereTheRobotIs(motion);
}

bool Execution::startsWhereTheRobotIs(Motion& motion) const {
  for (std::size_t j = 0; j < motion.group.joint_indices.size(); ++j) {
    const double begin = motion.trajectory.positions.front()[static_cast<Eigen::Index>(j)];
    const double now = motion.q_all[motion.group.joint_indices[j]];
    if (std::abs(begin - now) > kStartToleranceRad) {
      return motion.end(Result::INVALID_REQUEST, "joint '" + motion.group.joint_names[j] + "' is at " +
                                                     std::to_string(now) + ", the trajectory begins at " +
                                                     std::to_string(begin));
    }
  }
  return true;
}

bool Execution::mapAllows(Motion& motion) {
  if (motion.goal.map_sequence == 0) return true;
  motion.planned_on = maps_.kept(motion.goal.map_sequence);
  if (!motion.planned_on) {
    return motion.end(Result::MAP_CHANGED, "map " + std::to_string(motion.goal.map_sequence) +
                                               ", which the motion was planned on, is not known (any more)");
  }
  motion.checked_sequence = motion.goal.map_sequence;
  const std::string hit = obstacle(motion, 0.0);
  return hit.empty() || motion.end(Result::MAP_CHANGED, "the map changed since the plan: " + hit);
}

std::string Execution::obstacle(Motion& motion, double from_s) {
  if (!motion.planned_on) return {};
  std::string why;
  const auto map = maps_.latest(why);
  if (!map) return "the map is gone: " + why;
  if (map->map.sequence == motion.checked_sequence) return {};
  if (map->frame != motion.planned_on->frame) return "the map's frame changed to '" + map->frame + "'";
  if (!map->map.grid->coversSameVoxels(*motion.planned_on->map.grid))
    return "the map's resolution or its place about the robot changed";
  const auto obstacles =
      std::make_shared<VoxelGrid>(changedObstacles(*motion.planned_on->map.grid, *map->map.grid));
  std::string hit = obstacleOnTheWay(motion.planner->model(), motion.group, motion.q_all, map->T_map_root,
                                     obstacles, motion.planner->config(), motion.trajectory, from_s);
  if (hit.empty()) motion.checked_sequence = map->map.sequence;
  return hit;
}

/// Until all controllers are done, or one fails, or somebody cancels, or an obstacle shows up.
void Execution::watch(Motion& motion) {
  const double duration = motion.trajectory.duration();
  RosStopwatch stopwatch;
  double last_feedback_s = 0.0;
  while (true) {
    const double elapsed_s = stopwatch.elapsed();
    if (stopwatch.jumpedBack()) {
      motion.end(Result::CONTROLLER_FAILED, "the clock jumped back while the arm moved");
      break;
    }
    if (!goesOn(motion, elapsed_s)) break;
    if (elapsed_s - last_feedback_s > kFeedbackPeriodS) {
      motion.on_fraction(duration > 0.0 ? std::min(1.0, elapsed_s / duration) : 1.0);
      last_feedback_s = elapsed_s;
    }
    pause();
  }
  stop(motion);
}

/// False, with the result, when there is nothing left to wait for.
bool Execution::goesOn(Motion& motion, double elapsed_s) {
  std::string why;
  const auto outcome = motion.controllers.outcome(why);
  if (outcome == ControllerSet::Outcome::Succeeded) return motion.end(Result::SUCCESS, "executed");
  if (outcome == ControllerSet::Outcome::Failed) return motion.end(Result::CONTROLLER_FAILED, why);
  if (motion.cancelled())
    return motion.end(Result::CANCELLED, "cancelled after " + std::to_string(elapsed_s) + " s");
  if (elapsed_s > motion.trajectory.duration() + config_.settle_s)
    return motion.end(Result::CONTROLLER_FAILED, "the controllers did not finish in time");
  why = obstacle(motion, std::max(0.0, elapsed_s - 0.2));
  return why.empty() || motion.end(Result::STOPPED_FOR_OBSTACLE, why);
}

/// The answer says that the arm has stopped: waits for the controllers to say so.
void Execution::stop(Motion& motion) {
  motion.controllers.cancelAll();
  RosStopwatch stopwatch;
  while (!motion.controllers.allDone() && motion.controllers.connected() && ros::ok() &&
         stopwatch.elapsed() < config_.settle_s) {
    pause();
  }
}

void Execution::publishPath(const Motion& motion) {
  fv_msgs::PlannedPath path;
  std::string why;
  const auto map = motion.planned_on ? motion.planned_on : maps_.latest(why);
  const auto& model = motion.planner->model();
  path.header.stamp = ros::Time::now();
  path.header.frame_id = map ? map->frame : model.rootLink();
  path.map_sequence = motion.goal.map_sequence;
  path.trajectory = motion.goal.trajectory;
  if (motion.group.isChain()) {
    const auto tip = static_cast<std::size_t>(model.linkIndex(motion.group.tip_link));
    Eigen::VectorXd q = motion.q_all;
    for (const JointVector& q_group : motion.trajectory.positions) {
      model.setGroup(motion.group, q_group, q);
      const Eigen::Isometry3d T_root_tip = model.forward(q)[tip];
      path.tip_poses.push_back(msgFromIsometry(map ? map->T_map_root * T_root_tip : T_root_tip));
    }
  }
  path_publisher_.publish(path);
}

}  // namespace ompl_planner
