// Joint goals: named poses, joint values, and which link a pose speaks of.

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "goal_sampler.h"
#include "request_check.h"

namespace ompl_planner {
namespace {

using fv_robot_model::Group;
using fv_robot_model::RobotModel;

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

void setNamedJoints(const Group& group, const PlanRequest& request, JointVector& q) {
  if (request.goal_joints.empty()) throw std::invalid_argument("goal_joints names no joint");
  std::vector<std::string> names;
  for (const auto& goal : request.goal_joints) names.push_back(goal.first);
  checkNamedOnce(names, "goal_joints");
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

/// Nearest link above `link` (or itself) that a movable joint carries, and the fixed transform down from it.
std::pair<int, Eigen::Isometry3d> rigidAncestor(const RobotModel& model, int link) {
  Eigen::Isometry3d T_ancestor_link = Eigen::Isometry3d::Identity();
  while (model.parent(link) >= 0 && model.link(link).motion == RobotModel::Link::Motion::Fixed) {
    T_ancestor_link = model.link(link).T_parent_joint * T_ancestor_link;
    link = model.parent(link);
  }
  return {link, T_ancestor_link};
}

}  // namespace

JointVector groupValues(const Group& group, const Eigen::VectorXd& q_all) {
  JointVector q(static_cast<Eigen::Index>(group.joint_indices.size()));
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
    q[static_cast<Eigen::Index>(i)] = q_all[group.joint_indices[i]];
  }
  return q;
}

double nearestTurn(double angle, double near, const fv_robot_model::JointLimits& limits) {
  constexpr double kTurn = 2.0 * M_PI;
  double turns = std::round((near - angle) / kTurn);
  if (limits.bounded) {
    turns = std::min(turns, std::floor((limits.upper - angle) / kTurn));
    turns = std::max(turns, std::ceil((limits.lower - angle) / kTurn));
    if (angle + turns * kTurn > limits.upper) return angle;
  }
  return turns == 0.0 ? angle : angle + turns * kTurn;  // to the bit where nothing is to be done
}

bool turnsAlike(const RobotModel& model, int joint) {
  for (std::size_t i = 0; i < model.linkNames().size(); ++i) {
    const auto& link = model.link(static_cast<int>(i));
    if (link.variable != joint || link.motion == RobotModel::Link::Motion::Fixed) continue;
    const bool whole = link.multiplier == std::round(link.multiplier);
    if (link.motion != RobotModel::Link::Motion::Rotation || !whole) return false;
  }
  return true;
}

Eigen::VectorXd wholeTurns(const RobotModel& model, const Eigen::VectorXd& q_all) {
  constexpr double kTurn = 2.0 * M_PI;
  Eigen::VectorXd turns = Eigen::VectorXd::Zero(q_all.size());
  for (Eigen::Index i = 0; i < q_all.size(); ++i) {
    const int joint = static_cast<int>(i);
    const bool endless = !model.limits()[static_cast<std::size_t>(i)].bounded && turnsAlike(model, joint);
    if (endless) turns[i] = kTurn * std::round(q_all[i] / kTurn);
  }
  return turns;
}

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
  if (!request.exact_turns) {
    const JointVector start = groupValues(group, request.start_all);
    for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
      const auto& limits = model.limits()[static_cast<std::size_t>(group.joint_indices[i])];
      const auto j = static_cast<Eigen::Index>(i);
      if (!limits.bounded && turnsAlike(model, group.joint_indices[i]))
        q[j] = nearestTurn(q[j], start[j], limits);
    }
  }
  constexpr double kRounding = 1e-6;
  const std::string outside = outsideLimits(model, group, q, kRounding);
  if (!outside.empty()) throw std::invalid_argument("goal: " + outside);
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

}  // namespace ompl_planner
