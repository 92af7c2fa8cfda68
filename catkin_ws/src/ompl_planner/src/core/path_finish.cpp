// From a found path to a judged trajectory: shortcuts, rounded corners, timing, judge.

#include <algorithm>
#include <cmath>

#include "path_shortcut.h"
#include "planning_job.h"
#include "request_check.h"

namespace ompl_planner {
namespace {

/// The first joint whose value is beyond its limit, with both; empty when none is.
std::string tooFast(const fv_robot_model::Group& group, const std::string& kind, const JointVector& values,
                    const Eigen::VectorXd& limits) {
  constexpr double kRounding = 1.01;
  for (Eigen::Index j = 0; j < values.size(); ++j) {
    if (std::abs(values[j]) <= kRounding * limits[j]) continue;
    return "joint '" + group.joint_names[static_cast<std::size_t>(j)] + "' has " + kind + " " +
           std::to_string(values[j]) + ", its limit is " + std::to_string(limits[j]);
  }
  return {};
}

}  // namespace

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

MotionLimits MotionPlanner::limitsOf(const fv_robot_model::Group& group) const {
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

std::string MotionPlanner::beyondLimits(const fv_robot_model::Group& group,
                                        const TimedTrajectory& trajectory) const {
  const MotionLimits limits = limitsOf(group);
  for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
    std::string what = outsideLimits(*model_, group, trajectory.positions[i], config_.limit_tolerance_rad);
    if (what.empty()) what = tooFast(group, "velocity", trajectory.velocities[i], limits.velocity);
    if (what.empty()) what = tooFast(group, "acceleration", trajectory.accelerations[i], limits.acceleration);
    if (!what.empty()) return what + " at " + std::to_string(trajectory.times[i]) + " s";
  }
  return {};
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

/// Smallest clearance of the trajectory's points, up to field_cap_m. Each point need only tell whether it is
/// below what is known: that spares most of the balls.
double MotionPlanner::clearanceAlong(const Job& job) const {
  double clearance = config_.field_cap_m;
  for (const JointVector& q : job.result.trajectory.positions) {
    clearance = job.fast->clearance(job.searcher->posesAt(q), clearance);
  }
  return clearance;
}

}  // namespace ompl_planner
