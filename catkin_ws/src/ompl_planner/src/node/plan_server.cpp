#include "plan_server.h"

#include <algorithm>
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

PlanServer::PlanServer(ros::NodeHandle& nh, const MotionPlanner& planner, const RobotState& state,
                       MapKeeper& maps, const NodeConfig& config)
    : planner_(planner),
      state_(state),
      maps_(maps),
      config_(config),
      server_(
          nh, "/ompl_planner/plan", [this](const auto& goal) { onGoal(goal); }, /*auto_start=*/false) {
  server_.registerPreemptCallback([this] { cancel_ = true; });
  maps_.onPlaced([this](const PlacedMap& map) { warm(map); });
  server_.start();
}

void PlanServer::warm(const PlacedMap& map) {
  std::optional<PlanRequest> request;
  {
    const std::lock_guard<std::mutex> lock(last_mutex_);
    request = last_;
  }
  if (!request || request->unknown_space == UnknownSpace::FreeNearStart) return;
  request->map = map.map;
  request->T_map_root = map.T_map_root;
  planner_.warm(*request);
}

PlanServer::~PlanServer() {
  cancel_ = true;
  server_.shutdown();
}

void PlanServer::onGoal(const fv_msgs::PlanMotionGoalConstPtr& goal) {
  cancel_ = false;
  if (server_.isPreemptRequested()) cancel_ = true;
  const PlanResult result = plan(*goal);
  const auto msg = msgFromResult(result);
  switch (result.status) {
    case PlanStatus::Success:
      server_.setSucceeded(msg, result.message);
      return;
    case PlanStatus::Cancelled:
      server_.setPreempted(msg, result.message);
      return;
    default:
      ROS_WARN("plan: %s", result.message.c_str());
      server_.setAborted(msg, result.message);
  }
}

PlanResult PlanServer::plan(const fv_msgs::PlanMotionGoal& goal) {
  PlanResult failure;
  try {
    PlanRequest request = requestFromMsg(goal);
    if (!fillRequest(goal, request, failure)) return failure;
    if (planner_.knowsGroup(request.group)) {
      const std::lock_guard<std::mutex> lock(last_mutex_);
      last_ = request;
    }
    return planner_.solve(request, &cancel_, [this](const std::string& stage) {
      fv_msgs::PlanMotionFeedback feedback;
      feedback.stage = stage;
      server_.publishFeedback(feedback);
    });
  } catch (const std::invalid_argument& error) {
    failWith(failure, PlanStatus::InvalidRequest, error.what());
  } catch (const std::exception& error) {
    failWith(failure, PlanStatus::InternalError, error.what());
  }
  return failure;
}

bool PlanServer::fillRequest(const fv_msgs::PlanMotionGoal& goal, PlanRequest& request, PlanResult& failure) {
  std::string why;
  const auto map = maps_.atLeast(
      goal.min_map_sequence, config_.map_wait_s, [this] { return cancel_.load(); }, why);
  if (!map) return failWith(failure, PlanStatus::NoMap, why);
  failure.map_sequence = map->map.sequence;
  if (map->map.sequence < goal.min_map_sequence) {
    return failWith(failure, cancel_ ? PlanStatus::Cancelled : PlanStatus::MapTooOld,
                    "the latest map has sequence " + std::to_string(map->map.sequence) +
                        ", asked for at least " + std::to_string(goal.min_map_sequence));
  }
  request.map = map->map;
  request.T_map_root = map->T_map_root;
  const auto q_all = state_.joints(neededJoints(planner_.model(), goal.start), why);
  if (!q_all) return failWith(failure, PlanStatus::NoJointStates, why);
  request.start_all = *q_all;
  overlayJoints(goal.start, planner_.model(), request.start_all);
  const std::string& frame = goal.goal_poses.header.frame_id;
  if (!request.goal_poses.empty() && !frame.empty()) {
    const Eigen::Isometry3d T_map_frame = state_.transform(map->frame, frame);
    for (auto& pose : request.goal_poses) pose = T_map_frame * pose;
  }
  return true;
}

}  // namespace ompl_planner
