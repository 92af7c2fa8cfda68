#include "ompl_planner/motion_planner.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "ompl_planner/goal_sampler.h"
#include "ompl_planner/path_search.h"
#include "ompl_planner/path_shortcut.h"
#include "ompl_planner/prepared_world.h"
#include "ompl_planner/state_checker.h"

namespace ompl_planner {
namespace {

using Clock = std::chrono::steady_clock;
using fv_robot_model::Group;
using fv_robot_model::RobotModel;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

JointVector groupValues(const Group& group, const Eigen::VectorXd& q_all) {
  JointVector q(static_cast<Eigen::Index>(group.joint_indices.size()));
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
    q[static_cast<Eigen::Index>(i)] = q_all[group.joint_indices[i]];
  }
  return q;
}

void checkPoses(const PlanRequest& request) {
  if (request.goal_poses.empty()) throw std::invalid_argument("goal_poses is empty");
  if (!request.goal_scores.empty() && request.goal_scores.size() != request.goal_poses.size()) {
    throw std::invalid_argument("goal_scores has " + std::to_string(request.goal_scores.size()) +
                                " values for " + std::to_string(request.goal_poses.size()) + " poses");
  }
  for (std::size_t i = 0; i < request.goal_poses.size(); ++i) {
    if (!request.goal_poses[i].matrix().allFinite()) {
      throw std::invalid_argument("goal pose " + std::to_string(i) + " is not finite");
    }
    if (!request.goal_scores.empty() && !std::isfinite(request.goal_scores[i])) {
      throw std::invalid_argument("the score of goal pose " + std::to_string(i) + " is not finite");
    }
  }
}

void checkNotNegative(double value, const char* name) {
  if (!(value >= 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string(name) + " is " + std::to_string(value) +
                                ", must be 0 or positive");
  }
}

void checkRequest(const RobotModel& model, const PlanRequest& request) {
  model.group(request.group);  // throws, listing the valid ones
  if (request.start_all.size() != static_cast<Eigen::Index>(model.jointNames().size())) {
    throw std::invalid_argument("the start must have a value for each of the model's joints");
  }
  for (Eigen::Index i = 0; i < request.start_all.size(); ++i) {
    if (!std::isfinite(request.start_all[i])) {
      throw std::invalid_argument("start of joint '" + model.jointNames()[static_cast<std::size_t>(i)] +
                                  "' is not finite");
    }
  }
  if (!request.planner.empty()) checkPlannerName(request.planner);
  checkNotNegative(request.time_budget_s, "time_budget");
  checkNotNegative(request.position_tolerance_m, "position_tolerance");
  checkNotNegative(request.angle_tolerance_rad, "angle_tolerance");
  checkNotNegative(request.bubble_radius_m, "bubble_radius");
  if (request.unknown_space == UnknownSpace::FreeNearStart && request.bubble_radius_m <= 0.0) {
    throw std::invalid_argument("UNKNOWN_IS_FREE_NEAR_START needs a positive bubble_radius");
  }
  if (request.goal_type == GoalType::Poses) checkPoses(request);
}

}  // namespace

/// Everything that belongs to one request.
struct MotionPlanner::Job {
  const PlanRequest& request;
  const Group& group;
  StopCondition stop;
  StageCallback on_stage;
  PlanResult result{};
  Clock::time_point stage_begin{Clock::now()};

  JointVector start{};
  std::unique_ptr<StateChecker> searcher{};  ///< With search margin.
  std::unique_ptr<StateChecker> judge{};
  std::shared_ptr<const FastCollision> fast{};
  GoalStates goals{};
  JointPath path{};
  double search_step{0.0};  ///< Joint step of the search's edges [rad].

  void beginStage(const std::string& name) {
    endStage();
    result.stages.emplace_back(name, 0.0);
    if (on_stage) on_stage(name);
  }
  void endStage() {
    if (!result.stages.empty()) result.stages.back().second = secondsSince(stage_begin);
    stage_begin = Clock::now();
  }
  bool fail(PlanStatus status, const std::string& message) {
    result.status = stop.cancelled() ? PlanStatus::Cancelled : status;
    result.message = stop.cancelled() ? "cancelled" : message;
    return false;
  }
};

MotionPlanner::MotionPlanner(std::shared_ptr<const RobotModel> model,
                             const std::map<std::string, JointRates>& rates, const PlannerConfig& config)
    : model_(std::move(model)), rates_(rates), config_(config) {
  config_.validate();
  checkPlannerName(config_.planner);
  worlds_ = std::make_shared<WorldMemory>(config_.field_cap_m, config_.padding_m + config_.search_margin_m,
                                          config_.world_check == "fcl_octree");
  for (const std::string& name : model_->groupNames()) {
    const fv_robot_model::SelfCollisionConfig self_config{config_.self_padding_m, true};
    const Group& group = model_->group(name);
    self_[name] = std::make_shared<fv_robot_model::SelfCollision>(*model_, group, self_config);
    bare_self_[name] = std::make_shared<fv_robot_model::SelfCollision>(*model_, group);
  }
}

PlanResult MotionPlanner::solve(const PlanRequest& request, const std::atomic<bool>* cancel,
                                const StageCallback& on_stage) const {
  PlanResult failure;
  failure.map_sequence = request.map.sequence;
  try {
    checkRequest(*model_, request);
    if (!request.map.grid) {
      failure.status = PlanStatus::NoMap;
      failure.message = "no map has been received yet";
      return failure;
    }
    const double budget = request.time_budget_s > 0.0 ? request.time_budget_s : config_.time_budget_s;
    Job job{request, model_->group(request.group), StopCondition(budget, cancel), on_stage};
    job.result.map_sequence = request.map.sequence;
    run(job);
    job.endStage();
    return job.result;
  } catch (const std::invalid_argument& error) {
    failure.status = PlanStatus::InvalidRequest;
    failure.message = error.what();
  } catch (const std::exception& error) {
    failure.status = PlanStatus::InternalError;
    failure.message = error.what();
  }
  return failure;
}

void MotionPlanner::run(Job& job) const {
  job.beginStage("world");
  if (!prepareStart(job)) return;
  job.beginStage("goals");
  if (!collectGoals(job)) return;
  // Coarse steps first; what they overlook shows in the fine check of the result, and then fine steps find a
  // way.
  for (const double step : {config_.search_step_rad, config_.joint_step_rad}) {
    job.search_step = step;
    job.beginStage("search");
    if (!search(job)) return;
    job.beginStage("shortcut");
    if (shorten(job)) break;
  }
  job.beginStage("timing");
  if (!timeAndJudge(job)) return;
  job.result.clearance_m = config_.field_cap_m;
  for (const JointVector& q : job.result.trajectory.positions) {
    const auto& poses = job.searcher->posesAt(q);
    job.result.clearance_m =
        std::min(job.result.clearance_m, job.fast->clearance(poses, config_.field_cap_m));
  }
  job.result.status = PlanStatus::Success;
  job.result.message = "planned";
}

bool MotionPlanner::prepareStart(Job& job) const {
  const PlanRequest& request = job.request;
  job.start = groupValues(job.group, request.start_all);
  job.result.joint_names = job.group.joint_names;
  if (!model_->withinLimits(job.group, job.start, config_.limit_tolerance_rad)) {
    return job.fail(PlanStatus::InvalidRequest, "the start is outside the joint limits of group '" +
                                                    job.group.name + "' by more than the tolerance");
  }
  const auto poses = model_->forward(request.start_all);
  const PreparedWorld prepared =
      worlds_->get(request.map.grid, request.unknown_space, request.bubble_radius_m, *model_, job.group,
                   poses, request.T_map_root);
  const auto& self = self_.at(job.group.name);
  for (auto* checker : {&job.judge, &job.searcher}) {
    const bool searching = checker == &job.searcher;
    const double margin = searching ? config_.search_margin_m : 0.0;
    const double padding = config_.padding_m + margin;
    auto world = std::make_shared<WorldCollision>(*model_, job.group, request.T_map_root, prepared.grid,
                                                  padding, prepared.outside_is_free);
    if (const auto contact = world->allowStart(poses, config_.start_tolerance_m + margin)) {
      const bool unknown = contact->kind == Voxel::Unknown;
      return job.fail(unknown ? PlanStatus::StartInUnknown : PlanStatus::StartInCollision,
                      "start: " + describe(*model_, *contact));
    }
    auto fast = std::make_shared<FastCollision>(prepared.covers, prepared.field, world, request.T_map_root);
    std::shared_ptr<const WorldCheck> check = searching ? fast : nullptr;
    if (searching && prepared.octree) {
      check = std::make_shared<OctreeCollision>(*model_, job.group, request.T_map_root, prepared.octree,
                                                world, padding);
    }
    job.fast = fast;
    *checker = std::make_unique<StateChecker>(*model_, job.group, request.start_all, world, self,
                                              config_.joint_step_rad, check);
  }
  const auto& bare = bare_self_.at(job.group.name);
  if (const auto pair = bare->firstContact(poses)) {
    return job.fail(PlanStatus::StartInCollision,
                    "start: links '" + pair->first + "' and '" + pair->second + "' touch");
  }
  const auto close_pairs = self->contacts(poses);
  job.judge->allowClosePairs(bare, close_pairs);
  job.searcher->allowClosePairs(bare, close_pairs);
  return true;
}

bool MotionPlanner::collectGoals(Job& job) const {
  if (job.request.goal_type != GoalType::Poses) {
    const JointVector goal = jointGoal(*model_, job.group, job.request);
    if (!job.searcher->valid(goal)) {
      return job.fail(PlanStatus::GoalsInCollision, "goal: " + job.searcher->whyInvalid(goal));
    }
    job.goals.states.push_back({goal, -1});
  } else {
    const NumericIk ik(*model_, job.group);
    job.goals = sampleGoalStates(*model_, job.group, job.request, config_, ik, *job.searcher, job.stop);
  }
  job.result.poses_tried = job.goals.poses_tried;
  job.result.poses_reachable = job.goals.poses_reachable;
  job.result.goal_states = static_cast<std::uint32_t>(job.goals.states.size());
  if (!job.goals.states.empty()) return true;
  if (job.goals.poses_reachable == 0) return job.fail(PlanStatus::NoIkSolution, job.goals.unreachable_reason);
  return job.fail(PlanStatus::GoalsInCollision,
                  std::to_string(job.goals.poses_reachable) + " of " + std::to_string(job.goals.poses_tried) +
                      " poses have solutions, all of them in collision; " + job.goals.blocked_reason);
}

std::optional<JointPath> MotionPlanner::straightPath(const Job& job) const {
  for (const GoalState& goal : job.goals.states) {
    if (job.stop()) break;
    if (job.searcher->edgeValid(job.start, goal.q)) return JointPath{job.start, goal.q};
  }
  return std::nullopt;
}

bool MotionPlanner::search(Job& job) const {
  SearchProblem problem;
  const auto joints = job.group.joint_indices.size();
  problem.lower.resize(static_cast<Eigen::Index>(joints));
  problem.upper.resize(static_cast<Eigen::Index>(joints));
  for (std::size_t i = 0; i < joints; ++i) {
    const auto& limits = model_->limits()[static_cast<std::size_t>(job.group.joint_indices[i])];
    const auto j = static_cast<Eigen::Index>(i);
    problem.lower[j] = std::min(limits.lower, job.start[j]);  // the start may be a tolerance outside
    problem.upper[j] = std::max(limits.upper, job.start[j]);
    for (const GoalState& goal : job.goals.states) {  // continuous joints: goals of more than one turn
      problem.lower[j] = std::min(problem.lower[j], goal.q[j]);
      problem.upper[j] = std::max(problem.upper[j], goal.q[j]);
    }
  }
  problem.start = job.start;
  for (const GoalState& goal : job.goals.states) problem.goals.push_back(goal.q);
  problem.valid = [&job](const JointVector& q) { return job.searcher->valid(q); };
  problem.edge_valid = [&job](const JointVector& a, const JointVector& b) {
    return job.searcher->edgeValid(a, b, job.search_step);
  };
  problem.range_rad = config_.range_rad;
  problem.quality_rounds = static_cast<std::size_t>(config_.quality_rounds);
  const std::string& planner = job.request.planner.empty() ? config_.planner : job.request.planner;
  auto path = straightPath(job);
  if (!path) path = findPath(problem, planner, job.request.seed, [&job] { return job.stop(); });
  if (!path) {
    return job.fail(PlanStatus::NoPath, planner + " found no path to " +
                                            std::to_string(problem.goals.size()) + " goal states (" +
                                            std::to_string(job.searcher->checks()) + " states checked)");
  }
  job.path = std::move(*path);
  for (const GoalState& goal : job.goals.states) {
    if (maxJointStep(goal.q, job.path.back()) < 1e-9) {
      job.result.goal_index = goal.goal_index;
      break;
    }
  }
  return true;
}

/// False when fine steps find an obstacle on the path that the search overlooked.
bool MotionPlanner::shorten(Job& job) const {
  const auto edge_valid = [&job](const JointVector& a, const JointVector& b) {
    return job.searcher->edgeValid(a, b, job.search_step);
  };
  const auto stop = [&job] { return job.stop(); };
  job.path =
      shortcut(job.path, edge_valid, static_cast<int>(config_.shortcut_rounds), job.request.seed, stop);
  for (std::size_t i = 1; i < job.path.size(); ++i) {
    if (!job.searcher->edgeValid(job.path[i - 1], job.path[i])) return false;
  }
  return true;
}

MotionLimits MotionPlanner::limitsOf(const Group& group) const {
  MotionLimits limits;
  const auto joints = static_cast<Eigen::Index>(group.joint_indices.size());
  limits.velocity.resize(joints);
  limits.acceleration.resize(joints);
  for (Eigen::Index j = 0; j < joints; ++j) {
    const auto index = static_cast<std::size_t>(group.joint_indices[static_cast<std::size_t>(j)]);
    const auto found = rates_.find(model_->jointNames()[index]);
    const JointRates rates = found == rates_.end() ? JointRates{} : found->second;
    const double urdf_velocity = model_->limits()[index].velocity;
    limits.velocity[j] = rates.velocity > 0.0  ? rates.velocity
                         : urdf_velocity > 0.0 ? urdf_velocity
                                               : config_.default_max_velocity;
    limits.acceleration[j] = rates.acceleration > 0.0 ? rates.acceleration : config_.default_max_acceleration;
  }
  return limits;
}

namespace {

/// Largest corner radii, each halved until the rounded path is free; below a hundredth of a radian a corner
/// stays sharp.
std::vector<double> freeRadii(const JointPath& path, double radius, double step,
                              const StateChecker& checker) {
  constexpr double kMinRadius = 0.01;
  std::vector<double> radii(path.size(), radius);
  for (std::size_t i = 1; i + 1 < path.size(); ++i) {
    for (; radii[i] > 0.0; radii[i] = 0.5 * radii[i] < kMinRadius ? 0.0 : 0.5 * radii[i]) {
      const BlendedPath corner({path[i - 1], path[i], path[i + 1]}, {0.0, radii[i], 0.0});
      const double center = corner.waypointParameters()[1];
      const double reach = std::min(radii[i], center);
      bool free = true;
      for (double s = center - reach; s < center + reach && free; s += step)
        free = checker.valid(corner.at(s).q);
      if (free) break;
    }
  }
  return radii;
}

TimedTrajectory restingAt(const JointVector& q) {
  TimedTrajectory trajectory;
  trajectory.times = {0.0};
  trajectory.positions = {q};
  trajectory.velocities = {JointVector::Zero(q.size())};
  trajectory.accelerations = {JointVector::Zero(q.size())};
  return trajectory;
}

}  // namespace

bool MotionPlanner::timeAndJudge(Job& job) const {
  JointPath path = withoutRepeats(job.path);
  job.result.waypoints = path;
  job.result.path_length = pathLength(path);
  if (path.size() < 2) {
    job.result.trajectory = restingAt(job.start);
    return true;
  }
  const MotionLimits limits = limitsOf(job.group);
  auto radii = freeRadii(path, config_.blend_radius_rad, config_.joint_step_rad, *job.searcher);
  job.result.trajectory = timeOptimalTrajectory(BlendedPath(path, radii), limits, config_.timing());
  job.beginStage("judge");
  std::string refused = firstForbidden(job.result.trajectory, *job.judge, config_.joint_step_rad);
  if (refused.empty()) return true;
  // Rounded corners leave the searched lines by a little; with sharp ones the motion stays on them.
  std::fill(radii.begin(), radii.end(), 0.0);
  job.result.trajectory = timeOptimalTrajectory(BlendedPath(path, radii), limits, config_.timing());
  refused = firstForbidden(job.result.trajectory, *job.judge, config_.joint_step_rad);
  if (refused.empty()) return true;
  job.result.trajectory = {};
  return job.fail(PlanStatus::NoPath, "the judge refused the found path: " + refused);
}

void MotionPlanner::warm(const PlanRequest& request) const {
  const Group& group = model_->group(request.group);
  worlds_->get(request.map.grid, request.unknown_space, request.bubble_radius_m, *model_, group,
               model_->forward(request.start_all), request.T_map_root);
}

std::string MotionPlanner::judge(const PlanRequest& request, const TimedTrajectory& trajectory,
                                 double start_time_s) const {
  if (trajectory.times.empty()) return {};
  Job job{request, model_->group(request.group), StopCondition(3600.0, nullptr), {}};
  if (!prepareStart(job)) return job.result.message;
  return firstForbidden(trajectory, *job.judge, config_.joint_step_rad, start_time_s);
}

Eigen::AlignedBox3d MotionPlanner::reach(const Eigen::Isometry3d& T_map_root) const {
  return robotReach(*model_, T_map_root);
}

}  // namespace ompl_planner
