#include "conversions.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace ompl_planner {
namespace {

Eigen::Isometry3d makeIsometry(const Eigen::Vector3d& p, const Eigen::Quaterniond& q,
                               const std::string& what) {
  constexpr double kNormTolerance = 0.01;
  if (!p.allFinite() || !q.coeffs().allFinite()) throw std::invalid_argument(what + " is not finite");
  if (std::abs(q.norm() - 1.0) > kNormTolerance) {
    throw std::invalid_argument(what + ": its quaternion has norm " + std::to_string(q.norm()) +
                                ", must be 1");
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = p;
  T.linear() = q.normalized().toRotationMatrix();
  return T;
}

void checkOneGoalType(const fv_msgs::PlanMotionGoal& msg) {
  const bool joints = !msg.goal_joints.name.empty() || !msg.goal_joints.position.empty();
  const bool named = !msg.goal_name.empty();
  const bool poses = !msg.goal_poses.poses.empty();
  const auto type = msg.goal_type;
  if (type > fv_msgs::PlanMotionGoal::GOAL_POSES) {
    throw std::invalid_argument("goal_type is " + std::to_string(type) +
                                "; valid: 0 (GOAL_JOINTS), 1 (GOAL_NAMED), 2 (GOAL_POSES)");
  }
  if ((joints && type != fv_msgs::PlanMotionGoal::GOAL_JOINTS) ||
      (named && type != fv_msgs::PlanMotionGoal::GOAL_NAMED) ||
      (poses && type != fv_msgs::PlanMotionGoal::GOAL_POSES)) {
    throw std::invalid_argument("contradictory goals: a goal of another type than goal_type is filled in");
  }
}

JointVector vectorOr(const std::vector<double>& values, std::size_t size, const char* what) {
  if (values.empty()) return JointVector::Zero(static_cast<Eigen::Index>(size));
  if (values.size() != size)
    throw std::invalid_argument(std::string("a trajectory point has too few ") + what);
  return Eigen::Map<const JointVector>(values.data(), static_cast<Eigen::Index>(size));
}

std::vector<double> toList(const JointVector& values) {
  return {values.data(), values.data() + values.size()};
}

}  // namespace

Eigen::Isometry3d isometryFromMsg(const geometry_msgs::Pose& pose, const std::string& what) {
  const auto& [p, q] = std::tie(pose.position, pose.orientation);
  return makeIsometry({p.x, p.y, p.z}, Eigen::Quaterniond(q.w, q.x, q.y, q.z), what);
}

Eigen::Isometry3d isometryFromMsg(const geometry_msgs::Transform& transform) {
  const auto& [p, q] = std::tie(transform.translation, transform.rotation);
  return makeIsometry({p.x, p.y, p.z}, Eigen::Quaterniond(q.w, q.x, q.y, q.z), "a transform");
}

geometry_msgs::Pose msgFromIsometry(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  geometry_msgs::Pose pose;
  pose.position.x = T.translation().x();
  pose.position.y = T.translation().y();
  pose.position.z = T.translation().z();
  pose.orientation.x = q.x();
  pose.orientation.y = q.y();
  pose.orientation.z = q.z();
  pose.orientation.w = q.w();
  return pose;
}

std::unique_ptr<octomap::OcTree> octreeFromMsg(const fv_msgs::MapUpdate& msg) {
  const auto& octomap = msg.octomap;
  if (octomap.id != "OcTree")
    throw std::invalid_argument("map: tree type '" + octomap.id + "' is not OcTree");
  if (!std::isfinite(octomap.resolution) || octomap.resolution <= 0.0) {
    throw std::invalid_argument("map: resolution " + std::to_string(octomap.resolution) + " is not positive");
  }
  if (!octomap.header.frame_id.empty() && octomap.header.frame_id != msg.header.frame_id) {
    throw std::invalid_argument("map: its octomap is in frame '" + octomap.header.frame_id +
                                "', the message in '" + msg.header.frame_id + "'");
  }
  if (octomap.data.empty()) throw std::invalid_argument("map: it has no voxels");
  auto tree = std::make_unique<octomap::OcTree>(octomap.resolution);
  std::stringstream stream(std::string(octomap.data.begin(), octomap.data.end()));
  if (octomap.binary) {
    tree->readBinaryData(stream);
  } else {
    tree->readData(stream);
  }
  if (stream.fail() && !stream.eof()) throw std::invalid_argument("map: its data are broken");
  if (tree->size() == 0) throw std::invalid_argument("map: it has no voxels");
  return tree;
}

PlanRequest requestFromMsg(const fv_msgs::PlanMotionGoal& msg) {
  checkOneGoalType(msg);
  if (msg.unknown_space > fv_msgs::PlanMotionGoal::UNKNOWN_IS_FREE_NEAR_START) {
    throw std::invalid_argument("unknown_space is " + std::to_string(msg.unknown_space) + "; valid: 0, 1, 2");
  }
  if (msg.goal_joints.name.size() != msg.goal_joints.position.size()) {
    throw std::invalid_argument("goal_joints has " + std::to_string(msg.goal_joints.name.size()) +
                                " names and " + std::to_string(msg.goal_joints.position.size()) +
                                " positions");
  }
  PlanRequest request;
  request.group = msg.group;
  request.goal_type = static_cast<GoalType>(msg.goal_type);
  for (std::size_t i = 0; i < msg.goal_joints.name.size(); ++i) {
    request.goal_joints.emplace_back(msg.goal_joints.name[i], msg.goal_joints.position[i]);
  }
  request.goal_name = msg.goal_name;
  request.tip_link = msg.tip_link;
  for (std::size_t i = 0; i < msg.goal_poses.poses.size(); ++i) {
    request.goal_poses.push_back(isometryFromMsg(msg.goal_poses.poses[i], "goal pose " + std::to_string(i)));
  }
  request.goal_scores = msg.goal_scores;
  request.position_tolerance_m = msg.position_tolerance;
  request.angle_tolerance_rad = msg.angle_tolerance;
  request.free_roll = msg.free_roll;
  request.planner = msg.planner;
  request.time_budget_s = msg.time_budget;
  request.seed = msg.seed;
  request.unknown_space = static_cast<UnknownSpace>(msg.unknown_space);
  request.bubble_radius_m = msg.bubble_radius;
  return request;
}

void overlayJoints(const sensor_msgs::JointState& msg, const fv_robot_model::RobotModel& model,
                   Eigen::VectorXd& q_all) {
  if (msg.name.size() != msg.position.size()) {
    throw std::invalid_argument("start has " + std::to_string(msg.name.size()) + " names and " +
                                std::to_string(msg.position.size()) + " positions");
  }
  for (std::size_t i = 0; i < msg.name.size(); ++i) {
    if (!std::isfinite(msg.position[i])) {
      throw std::invalid_argument("start of joint '" + msg.name[i] + "' is not finite");
    }
    q_all[model.jointIndex(msg.name[i])] = msg.position[i];
  }
}

fv_msgs::PlanMotionResult msgFromResult(const PlanResult& result) {
  fv_msgs::PlanMotionResult msg;
  msg.status = static_cast<std::uint8_t>(result.status);
  msg.message = result.message;
  msg.trajectory = msgFromTrajectory(result.trajectory, result.joint_names);
  msg.goal_index = result.goal_index;
  msg.map_sequence = result.map_sequence;
  msg.path_length = result.path_length;
  msg.duration = result.trajectory.duration();
  msg.clearance = result.clearance_m;
  msg.poses_tried = result.poses_tried;
  msg.poses_reachable = result.poses_reachable;
  msg.goal_states = result.goal_states;
  for (const auto& [name, seconds] : result.stages) {
    msg.stages.push_back(name);
    msg.stage_seconds.push_back(seconds);
  }
  return msg;
}

trajectory_msgs::JointTrajectory msgFromTrajectory(const TimedTrajectory& trajectory,
                                                   const std::vector<std::string>& joint_names) {
  trajectory_msgs::JointTrajectory msg;
  msg.joint_names = joint_names;
  msg.points.resize(trajectory.times.size());
  for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
    auto& point = msg.points[i];
    point.time_from_start = ros::Duration(trajectory.times[i]);
    point.positions = toList(trajectory.positions[i]);
    point.velocities = toList(trajectory.velocities[i]);
    point.accelerations = toList(trajectory.accelerations[i]);
  }
  return msg;
}

TimedTrajectory trajectoryFromMsg(const trajectory_msgs::JointTrajectory& msg) {
  TimedTrajectory trajectory;
  const std::size_t joints = msg.joint_names.size();
  for (const auto& point : msg.points) {
    const double time = point.time_from_start.toSec();
    if (time < 0.0 || (!trajectory.times.empty() && time <= trajectory.times.back())) {
      throw std::invalid_argument("the trajectory's times do not ascend at " + std::to_string(time) + " s");
    }
    if (point.positions.size() != joints || joints == 0) {
      throw std::invalid_argument("a trajectory point has not one position per joint");
    }
    trajectory.times.push_back(time);
    trajectory.positions.push_back(vectorOr(point.positions, joints, "positions"));
    trajectory.velocities.push_back(vectorOr(point.velocities, joints, "velocities"));
    trajectory.accelerations.push_back(vectorOr(point.accelerations, joints, "accelerations"));
    if (!trajectory.positions.back().allFinite() || !trajectory.velocities.back().allFinite() ||
        !trajectory.accelerations.back().allFinite()) {
      throw std::invalid_argument("the trajectory is not finite at " + std::to_string(time) + " s");
    }
  }
  return trajectory;
}

}  // namespace ompl_planner
