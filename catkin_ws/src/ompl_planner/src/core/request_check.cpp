#include "request_check.h"

#include <cmath>
#include <set>
#include <stdexcept>

#include "path_search.h"

namespace ompl_planner {
namespace {

using fv_robot_model::RobotModel;

constexpr double kMaxBudgetS = 86400.0;  // what the steady clock can count in nanoseconds is a little more

void checkOnePerPose(std::size_t count, std::size_t poses, const char* name) {
  if (count == 0 || count == poses) return;
  throw std::invalid_argument(std::string(name) + " has " + std::to_string(count) + " values for " +
                              std::to_string(poses) + " poses");
}

void checkSeeds(const PlanRequest& request, std::size_t joints) {
  checkOnePerPose(request.goal_seeds.size(), request.goal_poses.size(), "goal_seeds");
  for (std::size_t i = 0; i < request.goal_seeds.size(); ++i) {
    const JointVector& seed = request.goal_seeds[i];
    if (seed.size() != static_cast<Eigen::Index>(joints) || !seed.allFinite()) {
      throw std::invalid_argument("the seed of goal pose " + std::to_string(i) + " must be " +
                                  std::to_string(joints) + " finite joint values");
    }
  }
}

void checkPoses(const PlanRequest& request) {
  if (request.goal_poses.empty()) throw std::invalid_argument("goal_poses is empty");
  checkOnePerPose(request.goal_scores.size(), request.goal_poses.size(), "goal_scores");
  for (std::size_t i = 0; i < request.goal_poses.size(); ++i) {
    if (!request.goal_poses[i].matrix().allFinite()) {
      throw std::invalid_argument("goal pose " + std::to_string(i) + " is not finite");
    }
    if (!request.goal_scores.empty() && !std::isfinite(request.goal_scores[i])) {
      throw std::invalid_argument("the score of goal pose " + std::to_string(i) + " is not finite");
    }
  }
  const double axis = request.roll_axis.norm();
  if (!(std::abs(axis - 1.0) < 1e-3)) {
    throw std::invalid_argument("roll_axis has length " + std::to_string(axis) + ", must be 1");
  }
}

void checkNotNegative(double value, const char* name) {
  if (!(value >= 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string(name) + " is " + std::to_string(value) +
                                ", must be 0 or positive");
  }
}

void checkStart(const RobotModel& model, const Eigen::VectorXd& start_all) {
  if (start_all.size() != static_cast<Eigen::Index>(model.jointNames().size())) {
    throw std::invalid_argument("the start must have a value for each of the model's joints");
  }
  for (Eigen::Index i = 0; i < start_all.size(); ++i) {
    if (!std::isfinite(start_all[i])) {
      throw std::invalid_argument("start of joint '" + model.jointNames()[static_cast<std::size_t>(i)] +
                                  "' is not finite");
    }
  }
}

}  // namespace

void checkNamedOnce(const std::vector<std::string>& joints, const std::string& what) {
  std::set<std::string> known;
  for (const std::string& joint : joints) {
    if (!known.insert(joint).second)
      throw std::invalid_argument(what + " names joint '" + joint + "' more than once");
  }
}

std::string outsideLimits(const RobotModel& model, const fv_robot_model::Group& group, const JointVector& q,
                          double tolerance) {
  for (std::size_t i = 0; i < group.joint_indices.size(); ++i) {
    const auto& limits = model.limits()[static_cast<std::size_t>(group.joint_indices[i])];
    const double value = q[static_cast<Eigen::Index>(i)];
    if (limits.bounded && !(value >= limits.lower - tolerance && value <= limits.upper + tolerance)) {
      return "joint '" + group.joint_names[i] + "' is " + std::to_string(value) + ", outside its limits " +
             std::to_string(limits.lower) + " to " + std::to_string(limits.upper);
    }
  }
  return {};
}

void checkRequest(const RobotModel& model, const PlanRequest& request) {
  const auto& group = model.group(request.group);  // throws, listing the valid ones
  checkStart(model, request.start_all);
  if (!request.planner.empty()) checkPlannerName(request.planner);
  checkNotNegative(request.time_budget_s, "time_budget");
  if (request.time_budget_s > kMaxBudgetS) {
    throw std::invalid_argument("time_budget is " + std::to_string(request.time_budget_s) +
                                " s, must be at most " + std::to_string(kMaxBudgetS));
  }
  checkNotNegative(request.position_tolerance_m, "position_tolerance");
  checkNotNegative(request.angle_tolerance_rad, "angle_tolerance");
  checkNotNegative(request.bubble_radius_m, "bubble_radius");
  if (request.unknown_space == UnknownSpace::FreeNearStart && request.bubble_radius_m <= 0.0) {
    throw std::invalid_argument("UNKNOWN_IS_FREE_NEAR_START needs a positive bubble_radius");
  }
  if (request.goal_type != GoalType::Poses) return;
  checkPoses(request);
  checkSeeds(request, group.joint_indices.size());
}

}  // namespace ompl_planner
