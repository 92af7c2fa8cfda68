#include "planning.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "conversions.h"

namespace ompl_planner {
namespace {

/// The joints whose present values a plan rests on: all that the start does not give.
std::vector<std::string> neededJoints(const fv_robot_model::RobotModel& model,
                                      const sensor_msgs::JointState& start) {
  std::vector<std::string> needed;
  for (const std::string& joint : model.jointNames()) {
    if (std::find(start.name.begin(), start.name.end(), joint) == start.name.end()) needed.push_back(joint);
  }
  return needed;
}

bool failWith(PlanResult& failure, PlanStatus status, const std::string& message) {
  failure.status = status;
  failure.message = message;
  return false;
}

}  // namespace

Planning::Planning(const CurrentPlanner& planner, const RobotState& state, MapKeeper& maps,
                   const PathPublisher& paths, const NodeConfig& config)
    : planner_(planner), state_(state), maps_(maps), paths_(paths), config_(config) {}

void Planning::warm(const PlacedMap& map) {
  std::optional<PlanRequest> request;
  {
    const std::lock_guard<std::mutex> lock(last_mutex_);
    request = last_;
  }
  if (!request || request->unknown_space == UnknownSpace::FreeNearStart) return;
  request->map = map.map;
  request->T_map_root = map.T_map_root;
  planner_.get()->warm(*request);
}

PlanResult Planning::plan(const fv_msgs::PlanMotionGoal& goal, const std::function<bool()>& cancelled,
                          const StageCallback& on_stage) {
  const Turns::Turn turn(turns_, cancelled);
  const auto stop = [&turn] { return turn.stopped(); };
  const auto planner = planner_.get();
  PlanResult failure;
  if (stop()) {
    failWith(failure, PlanStatus::Cancelled, "cancelled before planning began");
    return failure;
  }
  try {
    PlanRequest request = requestFromMsg(goal);
    std::string map_frame;
    if (!fillRequest(*planner, goal, stop, request, failure, map_frame)) return failure;
    if (planner->knowsGroup(request.group)) {
      const std::lock_guard<std::mutex> lock(last_mutex_);
      last_ = request;
    }
    const PlanResult result = planner->solve(request, stop, on_stage);
    if (result.status == PlanStatus::Success) show(*planner, request, map_frame, result);
    return result;
  } catch (const std::invalid_argument& error) {
    failWith(failure, PlanStatus::InvalidRequest, error.what());
  } catch (const std::exception& error) {
    failWith(failure, PlanStatus::InternalError, error.what());
  }
  return failure;
}

bool Planning::takeMap(const fv_msgs::PlanMotionGoal& goal, const std::function<bool()>& cancelled,
                       PlanRequest& request, PlanResult& failure, std::string& frame) {
  if (!(goal.max_map_age >= 0.0))
    throw std::invalid_argument("max_map_age is " + std::to_string(goal.max_map_age) +
                                ", must be 0 or positive");
  std::string why;
  const auto map = maps_.atLeast(goal.min_map_sequence, config_.map_wait_s, cancelled, why);
  if (!map) return failWith(failure, cancelled() ? PlanStatus::Cancelled : PlanStatus::NoMap, why);
  failure.map_sequence = map->map.sequence;
  if (map->map.sequence < goal.min_map_sequence) {
    return failWith(failure, cancelled() ? PlanStatus::Cancelled : PlanStatus::MapTooOld,
                    "the latest map has sequence " + std::to_string(map->map.sequence) +
                        ", asked for at least " + std::to_string(goal.min_map_sequence));
  }
  // A stamp from the future belongs to a clock that has jumped back since: how old is it? Nobody knows.
  const double age = ros::Time::now().toSec() - map->stamp.toSec();
  if (goal.max_map_age > 0.0 && std::abs(age) > goal.max_map_age) {
    return failWith(failure, PlanStatus::MapTooOld,
                    "the latest map is " + std::to_string(age) + " s old, allowed are " +
                        std::to_string(goal.max_map_age));
  }
  request.map = map->map;
  request.T_map_root = map->T_map_root;
  frame = map->frame;
  return true;
}

bool Planning::fillRequest(const MotionPlanner& planner, const fv_msgs::PlanMotionGoal& goal,
                           const std::function<bool()>& cancelled, PlanRequest& request, PlanResult& failure,
                           std::string& map_frame) {
  if (!takeMap(goal, cancelled, request, failure, map_frame)) return false;
  std::string why;
  const auto q_all = state_.joints(neededJoints(planner.model(), goal.start), why);
  if (!q_all) return failWith(failure, PlanStatus::NoJointStates, why);
  request.start_all = *q_all;
  overlayJoints(goal.start, planner.model(), request.start_all);
  const std::string& frame = goal.goal_poses.header.frame_id;
  if (!request.goal_poses.empty() && !frame.empty()) {
    const Eigen::Isometry3d T_map_frame = state_.transform(map_frame, frame);
    for (auto& pose : request.goal_poses) pose = T_map_frame * pose;
  }
  return true;
}

void Planning::show(const MotionPlanner& planner, const PlanRequest& request, const std::string& map_frame,
                    const PlanResult& result) const {
  paths_.publish({msgFromTrajectory(result.trajectory, result.joint_names), planner.model(),
                  planner.model().group(request.group), request.start_all, map_frame, request.T_map_root,
                  result.map_sequence, /*executing=*/false});
}

}  // namespace ompl_planner
