#include "ompl_planner/motion_planner.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "path_search.h"
#include "planning_job.h"
#include "prepared_world.h"
#include "reach.h"
#include "request_check.h"
#include "roadmap_memory.h"

namespace ompl_planner {
namespace {

using fv_robot_model::Group;
using fv_robot_model::RobotModel;

/// Lengths that searches for a shorter path may reach: by turns halfway to what is no detour, where paths are
/// found easily, and hardly more than that, where only good ones are. The shares were found by trying.
double detourBound(const JointPath& path, double detour_ratio, std::uint32_t search) {
  const double length = pathLength(path);
  const double aim = detour_ratio * (path.back() - path.front()).norm();
  return std::min(0.95 * length, search % 2U == 0U ? 0.5 * (aim + 0.9 * length) : 1.1 * aim);
}

}  // namespace

MotionPlanner::MotionPlanner(std::shared_ptr<const RobotModel> model,
                             const std::map<std::string, JointRates>& rates, const PlannerConfig& config)
    : model_(std::move(model)), rates_(rates), config_(config), roadmaps_(std::make_shared<RoadmapMemory>()) {
  config_.validate();
  checkPlannerName(config_.planner);
  worlds_ = std::make_shared<WorldMemory>(config_.field_cap_m, config_.padding_m + config_.search_margin_m,
                                          config_.world_check == "fcl_octree");
  for (const std::string& name : model_->groupNames()) {
    const fv_robot_model::SelfCollisionConfig self_config{config_.self_padding_m, true};
    const Group& group = model_->group(name);
    self_[name] = std::make_shared<fv_robot_model::SelfCollision>(*model_, group, self_config);
    const double margin = config_.self_padding_m + config_.self_search_margin_m;
    search_self_[name] = std::make_shared<fv_robot_model::SelfCollision>(
        *model_, group, fv_robot_model::SelfCollisionConfig{margin, true});
    bare_self_[name] = std::make_shared<fv_robot_model::SelfCollision>(*model_, group);
  }
}

std::shared_ptr<const MotionPlanner> MotionPlanner::holding(const std::vector<HeldObject>& objects) const {
  RobotModel model = *model_;
  for (const HeldObject& object : objects) {
    model = model.withAttached(object.name, object.link, {object.shape}, object.touch_links);
  }
  return std::make_shared<MotionPlanner>(std::make_shared<RobotModel>(std::move(model)), rates_, config_);
}

std::shared_ptr<const fv_robot_model::ik::IkSolver> MotionPlanner::ikOf(const PlanRequest& request,
                                                                        const Group& group) const {
  const double tolerance =
      request.angle_tolerance_rad > 0.0 ? request.angle_tolerance_rad : config_.angle_tolerance_rad;
  const std::lock_guard<std::mutex> lock(ik_mutex_);
  auto& [known_tolerance, solver] = ik_[group.name];
  if (!solver || known_tolerance != tolerance) {
    solver = makeGoalIk(*model_, group, config_, tolerance);
    known_tolerance = tolerance;
  }
  return solver;
}

PlanResult MotionPlanner::solve(const PlanRequest& request, const std::function<bool()>& cancelled,
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
    // Continuous joints are planned about zero, whatever turns they have made; these are put back at the end.
    PlanRequest within_a_turn = request;
    const Group& group = model_->group(request.group);
    const JointVector turns =
        groupValues(group, request.exact_turns ? Eigen::VectorXd::Zero(request.start_all.size()).eval()
                                               : wholeTurns(*model_, request.start_all));
    for (std::size_t i = 0; i < group.joint_indices.size(); ++i)
      within_a_turn.start_all[group.joint_indices[i]] -= turns[static_cast<Eigen::Index>(i)];
    const double budget = request.time_budget_s > 0.0 ? request.time_budget_s : config_.time_budget_s;
    Job job{within_a_turn, group, StopCondition(budget, cancelled), on_stage};
    job.result.map_sequence = request.map.sequence;
    run(job);
    job.endStage();
    for (JointVector& q : job.result.trajectory.positions) q += turns;
    for (JointVector& q : job.result.waypoints) q += turns;
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
  // way, without what roadmaps remember.
  for (const double step : {config_.search_step_rad, config_.joint_step_rad}) {
    job.search_step = step;
    job.may_use_roadmap = step == config_.search_step_rad;
    job.beginStage("search");
    if (!search(job)) return;
    job.beginStage("shortcut");
    if (shorten(job)) break;
  }
  shortenDetour(job);
  job.beginStage("timing");
  if (!timeAndJudge(job)) return;
  job.result.clearance_m = clearanceAlong(job);
  job.result.status = PlanStatus::Success;
  job.result.message = "planned";
}

bool MotionPlanner::prepareStart(Job& job) const {
  const PlanRequest& request = job.request;
  job.start = groupValues(job.group, request.start_all);
  job.result.joint_names = job.group.joint_names;
  const std::string outside = outsideLimits(*model_, job.group, job.start, config_.limit_tolerance_rad);
  if (!outside.empty()) return job.fail(PlanStatus::InvalidRequest, "start: " + outside);
  const auto poses = model_->forward(request.start_all);
  const PreparedWorld prepared =
      worlds_->get(request.map.grid, request.unknown_space, request.bubble_radius_m, *model_, job.group,
                   poses, request.T_map_root);
  const auto& search_self = search_self_.at(job.group.name);
  for (auto* checker : {&job.judge, &job.searcher}) {
    const bool searching = checker == &job.searcher;
    const double margin = searching ? config_.search_margin_m : 0.0;
    const double padding = config_.padding_m + margin;
    auto world =
        std::make_shared<WorldCollision>(worlds_->bodies(*model_, job.group, padding), request.T_map_root,
                                         prepared.grid, prepared.outside_is_free, prepared.blocks);
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
    const auto& self = searching ? search_self : self_.at(job.group.name);
    *checker = std::make_unique<StateChecker>(*model_, job.group, request.start_all, world, self,
                                              config_.joint_step_rad, check);
  }
  const auto& bare = bare_self_.at(job.group.name);
  if (const auto pair = bare->firstContact(poses)) {
    return job.fail(PlanStatus::StartInCollision,
                    "start: links '" + pair->first + "' and '" + pair->second +
                        "' touch; if they always do there, the SRDF lacks this pair: rosrun hubo_description "
                        "compute_disabled_pairs --robot FOLDER writes it");
  }
  const auto close_pairs = search_self->contacts(poses);
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
    const auto ik = ikOf(job.request, job.group);
    job.goals = sampleGoalStates(*model_, job.group, job.request, config_, *ik, *job.searcher, job.stop);
  }
  job.result.poses_tried = job.goals.poses_tried;
  job.result.poses_reachable = job.goals.poses_reachable;
  job.result.goal_states = static_cast<std::uint32_t>(job.goals.states.size());
  if (!job.goals.states.empty()) return true;
  if (job.stop()) {
    return job.fail(PlanStatus::NoPath, "time ran out while looking for goal states: " + job.goals.failure);
  }
  const bool none = job.goals.poses_reachable == 0;
  return job.fail(none ? PlanStatus::NoIkSolution : PlanStatus::GoalsInCollision, job.goals.failure);
}

std::optional<JointPath> MotionPlanner::straightPath(const Job& job) const {
  for (const GoalState& goal : job.goals.states) {
    if (job.stop()) break;
    if (job.searcher->edgeValid(job.start, goal.q)) return JointPath{job.start, goal.q};
  }
  return std::nullopt;
}

/// A path that is much longer than the straight line to its goal may have taken the wrong side of something:
/// searches among the states that a shorter one can pass. Counted, so that equal requests give equal paths.
void MotionPlanner::shortenDetour(Job& job) const {
  const std::string& planner = plannerOf(job.request);
  if (!isWorthRepeating(planner)) return;
  const auto is_detour = [&](const JointPath& path) {
    return pathLength(path) > config_.detour_ratio * (path.back() - path.front()).norm();
  };
  for (std::uint32_t i = 0; i < config_.detour_searches && is_detour(job.path) && !job.stop(); ++i) {
    const JointPath best = job.path;
    SearchProblem problem = shorterThan(searchProblem(job), detourBound(best, config_.detour_ratio, i));
    problem.search_rounds = static_cast<std::size_t>(config_.detour_rounds);
    const auto other =
        findPath(problem, planner, job.request.seed + 7919U * (i + 1U), [&job] { return job.stop(); });
    if (other) job.path = *other;
    if (!other || !shorten(job) || pathLength(job.path) >= pathLength(best)) job.path = best;
  }
  noteGoal(job);
}

const std::string& MotionPlanner::plannerOf(const PlanRequest& request) const {
  return request.planner.empty() ? config_.planner : request.planner;
}

/// Which goal the path ends at.
void MotionPlanner::noteGoal(Job& job) const {
  for (const GoalState& goal : job.goals.states) {
    if (maxJointStep(goal.q, job.path.back()) < 1e-9) {
      job.result.goal_index = goal.goal_index;
      return;
    }
  }
}

SearchProblem MotionPlanner::searchProblem(Job& job) const {
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
  return problem;
}

/// The planner's path; roadmaps of earlier queries are used where planner, map and policy allow.
std::optional<JointPath> MotionPlanner::plannedPath(Job& job, const std::string& planner) const {
  const SearchProblem problem = searchProblem(job);
  const auto stop = [&job] { return job.stop(); };
  const bool lasting = job.request.unknown_space != UnknownSpace::FreeNearStart;  // a bubble is one start's
  if (!keepsRoadmap(planner) || !lasting) return findPath(problem, planner, job.request.seed, stop);
  const std::lock_guard<std::mutex> lock(roadmaps_mutex_);
  if (!job.may_use_roadmap) {
    roadmaps_->forget(planner, job.group.name);
    return findPath(problem, planner, job.request.seed, stop);
  }
  RoadmapScope scope{job.group.name, job.request.unknown_space, job.request.start_all, job.request.T_map_root,
                     job.request.map.grid};
  for (const int joint : job.group.joint_indices) scope.others[joint] = 0.0;
  auto path = roadmaps_->findPath(scope, problem, planner, job.request.seed, stop);
  job.result.roadmap_states = roadmaps_->milestones();
  return path;
}

bool MotionPlanner::search(Job& job) const {
  const std::string& planner = plannerOf(job.request);
  auto path = straightPath(job);
  if (!path) path = plannedPath(job, planner);
  if (!path) {
    return job.fail(PlanStatus::NoPath, planner + " found no path to " +
                                            std::to_string(job.goals.states.size()) + " goal states (" +
                                            std::to_string(job.searcher->checks()) + " states checked)");
  }
  job.path = std::move(*path);
  noteGoal(job);
  return true;
}

void MotionPlanner::warm(const PlanRequest& request) const {
  const Group& group = model_->group(request.group);
  worlds_->get(request.map.grid, request.unknown_space, request.bubble_radius_m, *model_, group,
               model_->forward(request.start_all), request.T_map_root);
}

std::string MotionPlanner::judge(const PlanRequest& request, const TimedTrajectory& trajectory,
                                 double start_time_s) const {
  if (trajectory.times.empty()) return {};
  Job job{request, model_->group(request.group), StopCondition(3600.0, {}), {}};
  if (!prepareStart(job)) return job.result.message;
  return firstForbidden(trajectory, *job.judge, config_.joint_step_rad, start_time_s);
}

Eigen::AlignedBox3d MotionPlanner::reach(const Eigen::Isometry3d& T_map_root) const {
  return robotReach(*model_, T_map_root);
}

}  // namespace ompl_planner
