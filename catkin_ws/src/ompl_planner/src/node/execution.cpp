#include "execution.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "conversions.h"
#include "ros_stopwatch.h"
#include "trajectory_watch.h"

namespace ompl_planner {
namespace {

using Result = fv_msgs::ExecuteMotionResult;

constexpr double kStartToleranceRad = 0.1;  // a trajectory must begin where the robot is
constexpr double kFeedbackPeriodS = 0.05;
constexpr double kMaxDurationS = 3600.0;  // each new map is checked along the whole rest of the motion
constexpr double kRestRad = 0.002;        // an arm that moves less than this ...
constexpr double kRestS = 0.1;            // ... in this time is at rest
constexpr double kClockPatienceS = 5.0;   // of wall time that a clock may stand still while an arm is stopped

void pause() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

}  // namespace

/// One goal and what belongs to it.
struct Execution::Motion {
  const Turns::Turn& turn;
  std::function<void(double)> on_fraction;
  std::shared_ptr<const MotionPlanner> planner;
  ControllerSet controllers;
  PlannedMotionPtr planned{};
  fv_robot_model::Group group{};
  Eigen::VectorXd q_all{};
  Result result{};
  std::optional<PlacedMap> planned_on{};  ///< Empty: maps are not checked.
  std::uint64_t checked_sequence{0};      ///< The newest map that was found harmless.

  bool end(std::uint8_t status, const std::string& message) {
    result.status = status;
    result.message = clipped(message);
    return false;
  }
};

Execution::Execution(const CurrentPlanner& planner, const RobotState& state, MapKeeper& maps,
                     const PathPublisher& paths, const NodeParams& params)
    : planner_(planner),
      state_(state),
      maps_(maps),
      config_(params.node),
      controllers_(params.controllers),
      paths_(paths) {}

Result Execution::execute(const std::function<PlannedMotionPtr()>& planned, const Turns::Turn& turn,
                          const std::function<void(double)>& on_fraction) {
  Motion motion{turn, on_fraction, planner_.get(), ControllerSet(controllers_)};
  if (turn.stopped()) {
    motion.end(Result::CANCELLED, "cancelled before the arm moved");
    return motion.result;
  }
  try {
    motion.planned = planned();
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
  const auto stopped = [&motion] { return motion.turn.stopped(); };
  if (!motion.controllers.connect(config_.controller_wait_s, stopped, why)) {
    motion.end(stopped() ? Result::CANCELLED : Result::CONTROLLER_FAILED, why);
    return;
  }
  if (!mapAllows(motion)) return;
  if (stopped()) {
    motion.end(Result::CANCELLED, "cancelled before the arm moved");
    return;
  }
  show(motion);
  motion.controllers.send();
  watch(motion);
}

bool Execution::prepare(Motion& motion) {
  if (motion.planned->trajectory.times.empty())
    return motion.end(Result::INVALID_REQUEST, "the trajectory has no points");
  motion.group = groupOfJoints(motion.planner->model(), motion.planned->message.joint_names);
  if (!withinLimits(motion)) return false;
  motion.controllers.assign(motion.planned->message);
  std::string why;
  const auto q_all = state_.joints(motion.planner->model().jointNames(), why);
  if (!q_all) return motion.end(Result::INVALID_REQUEST, why);
  motion.q_all = *q_all;
  return startsWhereTheRobotIs(motion);
}

bool Execution::withinLimits(Motion& motion) const {
  if (motion.planned->trajectory.duration() > kMaxDurationS) {
    return motion.end(Result::INVALID_REQUEST,
                      "the trajectory lasts " + std::to_string(motion.planned->trajectory.duration()) +
                          " s, at most " + std::to_string(kMaxDurationS) + " are allowed");
  }
  const std::string beyond = motion.planner->beyondLimits(motion.group, motion.planned->trajectory);
  return beyond.empty() || motion.end(Result::INVALID_REQUEST, "the trajectory: " + beyond);
}

bool Execution::startsWhereTheRobotIs(Motion& motion) const {
  for (std::size_t j = 0; j < motion.group.joint_indices.size(); ++j) {
    const double begin = motion.planned->trajectory.positions.front()[static_cast<Eigen::Index>(j)];
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
  if (motion.planned->map_sequence == 0) return true;
  motion.planned_on = maps_.kept(motion.planned->map_sequence);
  if (!motion.planned_on) {
    return motion.end(Result::MAP_CHANGED, "map " + std::to_string(motion.planned->map_sequence) +
                                               ", which the motion was planned on, is not known (any more)");
  }
  motion.checked_sequence = motion.planned->map_sequence;
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
                                     obstacles, motion.planner->config(), motion.planned->trajectory, from_s);
  if (hit.empty()) motion.checked_sequence = map->map.sequence;
  return hit;
}

/// Until all controllers are done, or one fails, or somebody cancels, or an obstacle shows up.
void Execution::watch(Motion& motion) {
  const double duration = motion.planned->trajectory.duration();
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
  if (!motion.controllers.connected(why)) return motion.end(Result::CONTROLLER_FAILED, why);
  if (motion.turn.stopped())
    return motion.end(Result::CANCELLED, "cancelled after " + std::to_string(elapsed_s) + " s");
  if (elapsed_s > motion.planned->trajectory.duration() + config_.settle_s)
    return motion.end(Result::CONTROLLER_FAILED, "the controllers did not finish in time");
  why = obstacle(motion, std::max(0.0, elapsed_s - 0.2));
  return why.empty() || motion.end(Result::STOPPED_FOR_OBSTACLE, why);
}

/// The answer says that the arm has stopped: waits for the controllers to say so, and for the joints to rest,
/// for controllers answer when they begin to brake.
void Execution::stop(Motion& motion) {
  motion.controllers.cancelAll();
  RosStopwatch stopwatch;
  std::string why;
  while (!motion.controllers.allDone() && motion.controllers.connected(why) &&
         stopwatch.elapsed() < config_.settle_s && stopwatch.standsStill() < kClockPatienceS) {
    pause();
  }
  if (motion.controllers.sent() && motion.result.status != Result::SUCCESS) waitForRest(motion);
}

void Execution::waitForRest(const Motion& motion) const {
  RosStopwatch stopwatch;
  std::optional<Eigen::VectorXd> resting;
  double since_s = 0.0;
  std::string why;
  while (stopwatch.elapsed() < config_.settle_s && stopwatch.standsStill() < kClockPatienceS) {
    const auto q_all = state_.joints(motion.group.joint_names, why);
    if (!q_all) return;  // nobody tells where the arm is
    if (!resting || (*q_all - *resting).cwiseAbs().maxCoeff() > kRestRad) {
      resting = q_all;
      since_s = stopwatch.elapsed();
    }
    if (stopwatch.elapsed() - since_s > kRestS) return;
    pause();
  }
}

void Execution::show(const Motion& motion) {
  std::string why;
  const auto map = motion.planned_on ? motion.planned_on : maps_.latest(why);
  const auto& model = motion.planner->model();
  paths_.publish({motion.planned->message, model, motion.group, motion.q_all,
                  map ? map->frame : model.rootLink(), map ? map->T_map_root : Eigen::Isometry3d::Identity(),
                  motion.planned->map_sequence,
                  /*executing=*/true});
}

}  // namespace ompl_planner
