#include "goal_sampler.h"

#include <fv_robot_model/ik/group_solver.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <sstream>
#include <stdexcept>

#include "pose_target.h"

namespace ompl_planner {
namespace {

using fv_robot_model::Group;
using fv_robot_model::RobotModel;
using fv_robot_model::ik::IkSolutions;
using fv_robot_model::ik::reaches;

constexpr double kSameSolutionRad = 0.05;             // closer solutions count as one
constexpr double kGoldenAngle = 2.39996322972865332;  // [rad] its multiples fill the circle evenly
constexpr int kCheckedPerPose = 4;  // solutions of one pose and roll that are asked for collisions
constexpr int kDescentSteps = 100;  // of one descent within the tolerances
constexpr int kLastRounds = 4;      // of descents, when closed forms have found nothing

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
  target.roll_axis = request.roll_axis.normalized();
  target.position_tolerance_m =
      request.position_tolerance_m > 0.0 ? request.position_tolerance_m : config.position_tolerance_m;
  target.angle_tolerance_rad =
      request.angle_tolerance_rad > 0.0 ? request.angle_tolerance_rad : config.angle_tolerance_rad;
  return target;
}

/// One run of sampleGoalStates.
class Sampler {
 public:
  Sampler(const RobotModel& model, const Group& group, const PlanRequest& request,
          const PlannerConfig& config, const fv_robot_model::ik::IkSolver& ik, const StateChecker& checker)
      : model_(model),
        group_(group),
        request_(request),
        config_(config),
        ik_(ik),
        descent_(ik.chain(), kDescentSteps),
        checker_(checker),
        target_(targetOf(model, group, request, config)),
        start_(groupValues(group, request.start_all)),
        random_(request.seed),
        known_(request.goal_poses.size()) {
    const auto base = static_cast<std::size_t>(model.linkIndex(group.base_link));
    for (std::size_t k = 0; k < group.joint_indices.size(); ++k) {
      if (turnsAlike(model, group.joint_indices[k])) turning_.push_back(k);
    }
    T_base_map_ = (request.T_map_root * model.forward(request.start_all)[base]).inverse();
  }

  bool enough() const { return goals_.states.size() >= static_cast<std::size_t>(config_.max_goal_states); }

  bool foundNone() const { return goals_.poses_reachable == 0; }

  /// Solutions of one pose in one round.
  void visit(std::size_t index, int round) {
    if (round == 0) ++goals_.poses_tried;
    if (ik_.numerical() || (ik_.chain().dof() < 6 && withinTolerances(round))) {
      descend(index, round);
      return;
    }
    target_.T_base_tool = T_base_map_ * request_.goal_poses[index];
    const JointVector near = round == 1 ? seedOf(index) : start_;
    const JointVector seed = round < 2 || ik_.exact() ? near : randomState();
    solutions_.reset(ik_.chain().dof());
    ik_.solvePose(tipPose(near, round), seed.data(), solutions_);
    takeNearest(index);
  }

  /// Solutions of one pose within the tolerances, by descents from starts that each round has for itself.
  void descend(std::size_t index, int round) {
    target_.T_base_tool = T_base_map_ * request_.goal_poses[index];
    const JointVector near = round == 1 ? seedOf(index) : start_;
    const int starts = static_cast<int>(config_.ik_starts);
    solutions_.reset(ik_.chain().dof());
    descent_.solve(target_, round < 2 ? near.data() : nullptr, round * starts, starts, solutions_);
    takeNearest(index);
  }

  GoalStates finish() {
    sortByValue(request_, start_, goals_.states);
    if (goals_.states.empty()) goals_.failure = whyNone();
    return std::move(goals_);
  }

 private:
  /// How many poses failed for which reason, each reason with its first pose.
  std::string whyNone() const {
    std::map<Blockage::By, std::pair<std::uint32_t, std::string>> blocked;
    for (std::size_t i = 0; i < known_.size(); ++i) {
      if (known_[i].empty()) continue;
      const Blockage blockage = checker_.blockageAt(known_[i].front());
      auto& [count, first] = blocked[blockage.by];
      if (count++ == 0) first = "pose " + std::to_string(i) + ": " + blockage.text;
    }
    std::ostringstream text;
    text << "of " << goals_.poses_tried << " poses";
    const auto verb = [](std::uint32_t count, const char* one, const char* many) {
      return count == 1 ? one : many;
    };
    const std::uint32_t unsolved = goals_.poses_tried - goals_.poses_reachable;
    if (unsolved > 0) {
      text << ' ' << unsolved << verb(unsolved, " has", " have") << " no solution for group '" << group_.name
           << "' within " << target_.position_tolerance_m << " m and " << target_.angle_tolerance_rad
           << " rad";
    }
    const char* separator = unsolved > 0 ? ", " : " ";
    const std::map<Blockage::By, const char*> names{{Blockage::By::Obstacle, "obstacles"},
                                                    {Blockage::By::UnknownSpace, "unknown space"},
                                                    {Blockage::By::Robot, "the robot itself"},
                                                    {Blockage::By::Nothing, "nothing any more"}};
    for (const auto& [by, found] : blocked) {
      text << separator << found.first << verb(found.first, " is", " are") << " blocked by " << names.at(by)
           << " (" << found.second << ")";
      separator = ", ";
    }
    return text.str();
  }

  bool withinTolerances(int round) const { return 2 * round >= static_cast<int>(config_.ik_rounds); }

  JointVector seedOf(std::size_t index) const {
    return request_.goal_seeds.empty() ? start_ : request_.goal_seeds[index];
  }

  /// Solvers that sample or iterate find other solutions from other seeds.
  JointVector randomState() {
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    return JointVector::NullaryExpr(ik_.chain().dof(), [&](Eigen::Index i) {
      const auto& joint = ik_.chain().joint(static_cast<int>(i));
      return joint.lower + unit(random_) * (joint.upper - joint.lower);
    });
  }

  Eigen::Isometry3d tipPose(const JointVector& near, int round) {
    const Eigen::Isometry3d T_base_near = model_.tipPose(group_, near) * target_.T_tip_tool;
    const bool seeded = round == 1 && !request_.goal_seeds.empty();
    const double roll = seeded ? 0.0 : kGoldenAngle * round;
    if (!withinTolerances(round)) return tipPoseAt(target_, T_base_near, roll);
    return tipPoseWithin(target_, T_base_near, roll, random_);
  }

  /// Keeps the solution nearest to the start that is new and free.
  void takeNearest(std::size_t index) {
    nearest_.clear();
    for (int row = 0; row < solutions_.size(); ++row) {
      turnTowardsStart(solutions_.row(row));
      const Eigen::Map<const JointVector> q(solutions_.row(row), solutions_.dof());
      nearest_.emplace_back((q - start_).squaredNorm(), row);
    }
    const auto kept = std::min<std::size_t>(nearest_.size(), kCheckedPerPose);
    std::partial_sort(nearest_.begin(), nearest_.begin() + static_cast<std::ptrdiff_t>(kept), nearest_.end());
    for (std::size_t i = 0; i < kept; ++i) {
      const JointVector q =
          Eigen::Map<const JointVector>(solutions_.row(nearest_[i].second), solutions_.dof());
      if (isKnown(index, q) || !reaches(target_, model_.tipPose(group_, q))) continue;
      if (known_[index].empty()) ++goals_.poses_reachable;
      known_[index].push_back(q);
      const GoalState goal{q, static_cast<int>(index)};
      if (checker_.valid(q)) {
        goals_.states.push_back(goal);
        return;
      }
    }
  }

  /// Whole turns that the limits allow bring each joint as near to the start as can be.
  void turnTowardsStart(double* q) const {
    for (const std::size_t k : turning_) {
      const auto joint = static_cast<std::size_t>(group_.joint_indices[k]);
      q[k] = nearestTurn(q[k], start_[static_cast<Eigen::Index>(k)], model_.limits()[joint]);
    }
  }

  bool isKnown(std::size_t index, const JointVector& q) const {
    return std::any_of(known_[index].begin(), known_[index].end(),
                       [&](const JointVector& other) { return maxJointStep(other, q) < kSameSolutionRad; });
  }

  const RobotModel& model_;
  const Group& group_;
  const PlanRequest& request_;
  const PlannerConfig& config_;
  const fv_robot_model::ik::IkSolver& ik_;
  fv_robot_model::ik::TolerantIk descent_;
  const StateChecker& checker_;
  PoseTarget target_;
  JointVector start_;
  Eigen::Isometry3d T_base_map_;
  std::mt19937_64 random_;
  std::vector<std::vector<JointVector>> known_;  ///< Solutions by pose.
  std::vector<std::size_t> turning_;  ///< Joints, by place in the group, that may end whole turns further on.
  IkSolutions solutions_;
  std::vector<std::pair<double, int>> nearest_;  ///< Squared distance from the start, row of solutions_.
  GoalStates goals_;
};

}  // namespace

std::unique_ptr<fv_robot_model::ik::IkSolver> makeGoalIk(const RobotModel& model, const Group& group,
                                                         const PlannerConfig& config,
                                                         double angle_tolerance_rad) {
  if (!group.isChain()) {
    throw std::invalid_argument("group '" + group.name + "' is no chain: no poses for it");
  }
  fv_robot_model::ik::IkOptions options;
  options.sweep_step_rad = config.ik_step_rad;
  options.numerical_starts = static_cast<int>(config.ik_starts);
  if (group.joint_indices.size() < 6) options.direction_tolerance_rad = angle_tolerance_rad;
  return fv_robot_model::ik::makeIkSolver(model, group.name, options);
}

GoalStates sampleGoalStates(const RobotModel& model, const Group& group, const PlanRequest& request,
                            const PlannerConfig& config, const fv_robot_model::ik::IkSolver& ik,
                            const StateChecker& checker, const StopCondition& stop) {
  Sampler sampler(model, group, request, config, ik, checker);
  const auto order = byScore(request);
  for (int round = 0; round < static_cast<int>(config.ik_rounds); ++round) {
    for (const std::size_t index : order) {
      if (sampler.enough() || stop()) return sampler.finish();
      sampler.visit(index, round);
    }
  }
  for (int round = 0; round < kLastRounds && sampler.foundNone() && !ik.numerical(); ++round) {
    for (const std::size_t index : order) {
      if (sampler.enough() || stop()) return sampler.finish();
      sampler.descend(index, round);
    }
  }
  return sampler.finish();
}

}  // namespace ompl_planner
