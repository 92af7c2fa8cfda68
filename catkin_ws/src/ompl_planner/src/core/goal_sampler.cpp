#include "ompl_planner/goal_sampler.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>

namespace ompl_planner {
namespace {

using fv_robot_model::Group;
using fv_robot_model::RobotModel;

constexpr double kSameSolutionRad = 0.05;  // closer solutions count as one

std::string join(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::vector<std::string> stateNames(const RobotModel& model, const Group& group) {
  std::vector<std::string> names;
  for (const auto& [name, values] : model.namedStates(group.name)) names.push_back(name);
  return names;
}

JointVector groupValues(const Group& group, const Eigen::VectorXd& q_all) {
  JointVector q(static_cast<Eigen::Index>(group.joint_indices.size()));
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
    q[static_cast<Eigen::Index>(i)] = q_all[group.joint_indices[i]];
  }
  return q;
}

void setNamedJoints(const Group& group, const PlanRequest& request, JointVector& q) {
  if (request.goal_joints.empty()) throw std::invalid_argument("goal_joints names no joint");
  for (const auto& [name, value] : request.goal_joints) {
    const auto found = std::find(group.joint_names.begin(), group.joint_names.end(), name);
    if (found == group.joint_names.end()) {
      throw std::invalid_argument("goal joint '" + name + "' is not in group '" + group.name +
                                  "'; valid: " + join(group.joint_names));
    }
    if (!std::isfinite(value)) throw std::invalid_argument("goal joint '" + name + "' is not finite");
    q[found - group.joint_names.begin()] = value;
  }
}

void checkLimits(const RobotModel& model, const Group& group, const JointVector& q) {
  constexpr double kRounding = 1e-6;
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
    const auto& limits = model.limits()[static_cast<std::size_t>(group.joint_indices[i])];
    const double value = q[static_cast<Eigen::Index>(i)];
    if (limits.bounded && (value < limits.lower - kRounding || value > limits.upper + kRounding)) {
      throw std::invalid_argument("goal of joint '" + group.joint_names[i] + "' is " + std::to_string(value) +
                                  ", outside its limits " + std::to_string(limits.lower) + " to " +
                                  std::to_string(limits.upper));
    }
  }
}

/// Nearest link above `link` (or itself) that a movable joint carries, and the fixed transform down from it.
std::pair<int, Eigen::Isometry3d> rigidAncestor(const RobotModel& model, int link) {
  Eigen::Isometry3d T_ancestor_link = Eigen::Isometry3d::Identity();
  while (model.parent(link) >= 0 && model.link(link).motion == RobotModel::Link::Motion::Fixed) {
    T_ancestor_link = model.link(link).T_parent_joint * T_ancestor_link;
    link = model.parent(link);
  }
  return {link, T_ancestor_link};
}

/// Indices of the poses, best score first; equal scores keep their order.
std::vector<std::size_t> byScore(const PlanRequest& request) {
  std::vector<std::size_t> order(request.goal_poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (request.goal_scores.empty()) return order;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return request.goal_scores[a] > request.goal_scores[b];
  });
  return order;
}

JointVector randomState(const RobotModel& model, const Group& group, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  JointVector q(static_cast<Eigen::Index>(group.joint_indices.size()));
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
    const auto& limits = model.limits()[static_cast<std::size_t>(group.joint_indices[i])];
    q[static_cast<Eigen::Index>(i)] = limits.lower + unit(random) * (limits.upper - limits.lower);
  }
  return q;
}

bool isKnown(const std::vector<JointVector>& solutions, const JointVector& q) {
  return std::any_of(solutions.begin(), solutions.end(),
                     [&](const JointVector& other) { return maxJointStep(other, q) < kSameSolutionRad; });
}

/// Value of reaching a goal state: its score, from 0.1 for the lowest to 1 for the highest, per way to go.
double valuePerCost(const PlanRequest& request, const GoalState& goal, const JointVector& start) {
  double score = 1.0;
  if (!request.goal_scores.empty()) {
    const auto [low, high] = std::minmax_element(request.goal_scores.begin(), request.goal_scores.end());
    const double own = request.goal_scores[static_cast<std::size_t>(goal.goal_index)];
    if (*high > *low) score = 0.1 + 0.9 * (own - *low) / (*high - *low);
  }
  return score / (0.5 + (goal.q - start).norm());
}

void sortByValue(const PlanRequest& request, const JointVector& start, std::vector<GoalState>& states) {
  std::stable_sort(states.begin(), states.end(), [&](const GoalState& a, const GoalState& b) {
    return valuePerCost(request, a, start) > valuePerCost(request, b, start);
  });
}

PoseTarget targetOf(const RobotModel& model, const Group& group, const PlanRequest& request,
                    const PlannerConfig& config) {
  PoseTarget target;
  target.T_tip_tool = tipToTool(model, group, request.tip_link);
  target.free_roll = request.free_roll;
  target.position_tolerance_m =
      request.position_tolerance_m > 0.0 ? request.position_tolerance_m : config.position_tolerance_m;
  target.angle_tolerance_rad =
      request.angle_tolerance_rad > 0.0 ? request.angle_tolerance_rad : config.angle_tolerance_rad;
  return target;
}

}  // namespace

JointVector jointGoal(const RobotModel& model, const Group& group, const PlanRequest& request) {
  JointVector q = groupValues(group, request.start_all);
  if (request.goal_type == GoalType::Named) {
    const auto& states = model.namedStates(group.name);
    const auto found = states.find(request.goal_name);
    if (found == states.end()) {
      throw std::invalid_argument("group '" + group.name + "' has no state '" + request.goal_name +
                                  "'; valid: " + join(stateNames(model, group)));
    }
    q = found->second;
  } else {
    setNamedJoints(group, request, q);
  }
  checkLimits(model, group, q);
  return q;
}

Eigen::Isometry3d tipToTool(const RobotModel& model, const Group& group, const std::string& tip_link) {
  if (!group.isChain()) throw std::invalid_argument("group '" + group.name + "' is no chain: it has no tip");
  if (tip_link.empty() || tip_link == group.tip_link) return Eigen::Isometry3d::Identity();
  const auto [tip_body, T_body_tip] = rigidAncestor(model, model.linkIndex(group.tip_link));
  const auto [tool_body, T_body_tool] = rigidAncestor(model, model.linkIndex(tip_link));
  if (tip_body != tool_body) {
    throw std::invalid_argument("link '" + tip_link + "' does not move rigidly with '" + group.tip_link +
                                "', the tip of group '" + group.name + "'");
  }
  return T_body_tip.inverse() * T_body_tool;
}

GoalStates sampleGoalStates(const RobotModel& model, const Group& group, const PlanRequest& request,
                            const PlannerConfig& config, const PoseIk& ik, const StateChecker& checker,
                            const StopCondition& stop) {
  PoseTarget target = targetOf(model, group, request, config);
  const auto base = static_cast<std::size_t>(model.linkIndex(group.base_link));
  const Eigen::Isometry3d T_base_map =
      (request.T_map_root * model.forward(request.start_all)[base]).inverse();
  const JointVector start = groupValues(group, request.start_all);
  const auto order = byScore(request);
  std::vector<std::vector<JointVector>> solutions(order.size());  // by pose
  std::mt19937_64 random(request.seed);

  GoalStates goals;
  const auto enough = [&] { return goals.states.size() >= static_cast<std::size_t>(config.max_goal_states); };
  // Round by round over all poses, so that many views share the effort; the first round starts from where the
  // arm is.
  for (int round = 0; round < static_cast<int>(config.ik_starts); ++round) {
    for (const std::size_t index : order) {
      if (enough() || stop()) break;
      if (round == 0) ++goals.poses_tried;
      target.T_base_tool = T_base_map * request.goal_poses[index];
      const auto q = ik.solve(target, round == 0 ? start : randomState(model, group, random));
      if (!q || isKnown(solutions[index], *q)) continue;
      goals.poses_reachable += solutions[index].empty() ? 1 : 0;
      solutions[index].push_back(*q);
      if (checker.valid(*q)) {
        goals.states.push_back({*q, static_cast<int>(index)});
      } else if (goals.blocked_reason.empty()) {
        goals.blocked_reason = "pose " + std::to_string(index) + ": " + checker.whyInvalid(*q);
      }
    }
  }
  sortByValue(request, start, goals.states);
  if (goals.poses_reachable == 0) {
    goals.unreachable_reason = "none of " + std::to_string(goals.poses_tried) +
                               " poses has a solution for group '" + group.name + "' (" +
                               std::to_string(static_cast<int>(config.ik_starts)) + " starts each)";
  }
  return goals;
}

}  // namespace ompl_planner
