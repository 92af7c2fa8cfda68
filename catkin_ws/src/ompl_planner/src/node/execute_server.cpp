#include "execute_server.h"

#include <fv_msgs/PlannedPath.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "conversions.h"
#include "ompl_planner/trajectory_watch.h"

namespace ompl_planner {
namespace {

using Result = fv_msgs::ExecuteMotionResult;

constexpr double kStartToleranceRad = 0.1;  // a trajectory must begin where the robot is

void pause() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

}  // namespace

/// One goal and what belongs to it.
struct ExecuteServer::Motion {
  const fv_msgs::ExecuteMotionGoal& goal;
  ControllerSet controllers;
  TimedTrajectory trajectory{};
  fv_robot_model::Group group{};
  Eigen::VectorXd q_all{};
  Result result{};
  std::optional<PlacedMap> planned_on{};  ///< Empty: maps are not checked.
  std::uint64_t checked_sequence{0};      ///< The newest map that was found harmless.

  bool fail(std::uint8_t status, const std::string& message) {
    result.status = status;
    result.message = message;
    return false;
  }
};

ExecuteServer::ExecuteServer(ros::NodeHandle& nh, const MotionPlanner& planner, const RobotState& state,
                             MapKeeper& maps, const NodeParams& params)
    : planner_(planner),
      state_(state),
      maps_(maps),
      config_(params.node),
      controllers_(params.controllers),
      path_publisher_(nh.advertise<fv_msgs::PlannedPath>("/ompl_planner/path", 1, /*latch=*/true)),
      server_(
          nh, "/ompl_planner/execute", [this](const auto& goal) { onGoal(goal); }, /*auto_start=*/false) {
  server_.registerPreemptCallback([this] { cancel_ = true; });
  server_.start();
}

ExecuteServer::~ExecuteServer() {
  cancel_ = true;
  server_.shutdown();
}

void ExecuteServer::onGoal(const fv_msgs::ExecuteMotionGoalConstPtr& goal) {
  cancel_ = false;
  if (server_.isPreemptRequested()) cancel_ = true;
  Motion motion{*goal, ControllerSet(controllers_)};
  try {
    run(motion);
  } catch (const std::exception& error) {
    motion.fail(Result::INVALID_REQUEST, error.what());
  }
  motion.result.max_tracking_error = motion.controllers.maxTrackingError();
  if (motion.result.status == Result::SUCCESS) {
    server_.setSucceeded(motion.result, motion.result.message);
  } else if (motion.result.status == Result::CANCELLED) {
    server_.setPreempted(motion.result, motion.result.message);
  } else {
    ROS_WARN("execute: %s", motion.result.message.c_str());
    server_.setAborted(motion.result, motion.result.message);
  }
}

void ExecuteServer::run(Motion& motion) {
  if (!prepare(motion)) return;
  std::string why;
  if (!motion.controllers.connect(
          config_.controller_wait_s, [this] { return cancel_.load(); }, why)) {
    motion.fail(cancel_ ? Result::CANCELLED : Result::CONTROLLER_FAILED, why);
    return;
  }
  publishPath(motion);
  motion.controllers.send();
  watch(motion);
}

bool ExecuteServer::prepare(Motion& motion) {
  motion.trajectory = trajectoryFromMsg(motion.goal.trajectory);
  if (motion.trajectory.times.empty())
    return motion.fail(Result::INVALID_REQUEST, "the trajectory has no points");
  motion.group = groupOfJoints(planner_.model(), motion.goal.trajectory.joint_names);
  motion.controllers.assign(motion.goal.trajectory);
  std::string why;
  const auto q_all = state_.joints(planner_.model().jointNames(), why);
  if (!q_all) return motion.fail(Result::INVALID_REQUEST, why);
  motion.q_all = *q_all;
  for (std::size_t j = 0; j < motion.group.joint_indices.size(); ++j) {
    const double begin = motion.trajectory.positions.front()[static_cast<Eigen::Index>(j)];
    const double now = motion.q_all[motion.group.joint_indices[j]];
    if (std::abs(begin - now) > kStartToleranceRad) {
      return motion.fail(Result::INVALID_REQUEST, "joint '" + motion.group.joint_names[j] + "' is at " +
                                                      std::to_string(now) + ", the trajectory begins at " +
                                                      std::to_string(begin));
    }
  }
  if (motion.goal.map_sequence == 0) return true;
  motion.planned_on = maps_.kept(motion.goal.map_sequence);
  if (!motion.planned_on) {
    return motion.fail(Result::MAP_CHANGED, "map " + std::to_string(motion.goal.map_sequence) +
                                                ", which the motion was planned on, is not known (any more)");
  }
  motion.checked_sequence = motion.goal.map_sequence;
  const std::string hit = obstacle(motion, 0.0);
  return hit.empty() || motion.fail(Result::MAP_CHANGED, "the map changed since the plan: " + hit);
}

std::string ExecuteServer::obstacle(Motion& motion, double from_s) {
  if (!motion.planned_on) return {};
  std::string why;
  const auto map = maps_.latest(why);
  if (!map) return "the map is gone: " + why;
  if (map->map.sequence == motion.checked_sequence) return {};
  if (map->frame != motion.planned_on->frame) return "the map's frame changed to '" + map->frame + "'";
  const auto obstacles =
      std::make_shared<VoxelGrid>(changedObstacles(*motion.planned_on->map.grid, *map->map.grid));
  std::string hit = obstacleOnTheWay(planner_.model(), motion.group, motion.q_all, map->T_map_root, obstacles,
                                     planner_.config(), motion.trajectory, from_s);
  if (hit.empty()) motion.checked_sequence = map->map.sequence;
  return hit;
}

/// Until all controllers are done, or one fails, or somebody cancels, or an obstacle shows up.
void ExecuteServer::watch(Motion& motion) {
  const double duration = motion.trajectory.duration();
  const ros::Time begin = ros::Time::now();
  ros::Time last_feedback = begin;
  std::string why;
  while (true) {
    const auto outcome = motion.controllers.outcome(why);
    if (outcome == ControllerSet::Outcome::Succeeded) {
      motion.fail(Result::SUCCESS, "executed");
      return;
    }
    const ros::Time now = ros::Time::now();
    const double elapsed = (now - begin).toSec();
    if (outcome == ControllerSet::Outcome::Failed) {
      motion.fail(Result::CONTROLLER_FAILED, why);
    } else if (cancel_ || !ros::ok()) {
      motion.fail(Result::CANCELLED, "cancelled after " + std::to_string(elapsed) + " s");
    } else if (elapsed > duration + config_.settle_s || elapsed < -1.0) {
      motion.fail(Result::CONTROLLER_FAILED, "the controllers did not finish in time");
    } else if (!(why = obstacle(motion, std::max(0.0, elapsed - 0.2))).empty()) {
      motion.fail(Result::STOPPED_FOR_OBSTACLE, why);
    } else {
      if ((now - last_feedback).toSec() > 0.05) {
        fv_msgs::ExecuteMotionFeedback feedback;
        feedback.fraction = duration > 0.0 ? std::min(1.0, elapsed / duration) : 1.0;
        server_.publishFeedback(feedback);
        last_feedback = now;
      }
      pause();
      continue;
    }
    break;
  }
  motion.controllers.cancelAll();
  // The answer says that the arm has stopped: wait for the controllers to say so.
  for (int i = 0; i < 200 && !motion.controllers.allDone() && ros::ok(); ++i) pause();
}

void ExecuteServer::publishPath(const Motion& motion) {
  fv_msgs::PlannedPath path;
  std::string why;
  const auto map = motion.planned_on ? motion.planned_on : maps_.latest(why);
  path.header.stamp = ros::Time::now();
  path.header.frame_id = map ? map->frame : planner_.model().rootLink();
  path.map_sequence = motion.goal.map_sequence;
  path.trajectory = motion.goal.trajectory;
  if (motion.group.isChain()) {
    const auto tip = static_cast<std::size_t>(planner_.model().linkIndex(motion.group.tip_link));
    Eigen::VectorXd q = motion.q_all;
    for (const JointVector& q_group : motion.trajectory.positions) {
      planner_.model().setGroup(motion.group, q_group, q);
      const Eigen::Isometry3d T_root_tip = planner_.model().forward(q)[tip];
      path.tip_poses.push_back(msgFromIsometry(map ? map->T_map_root * T_root_tip : T_root_tip));
    }
  }
  path_publisher_.publish(path);
}

}  // namespace ompl_planner
