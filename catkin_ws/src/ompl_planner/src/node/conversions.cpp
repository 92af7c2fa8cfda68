#include "conversions.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "request_check.h"

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

/// A unit vector; z for one that is not filled in.
Eigen::Vector3d rollAxis(const geometry_msgs::Vector3& msg) {
  const Eigen::Vector3d axis(msg.x, msg.y, msg.z);
  if (!axis.allFinite()) throw std::invalid_argument("roll_axis is not finite");
  return axis.isZero(0.0) ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d(axis.normalized());
}

std::vector<JointVector> seedsFromList(const std::vector<double>& values, std::size_t poses) {
  if (values.empty()) return {};
  if (poses == 0 || values.size() % poses != 0) {
    throw std::invalid_argument("goal_seeds has " + std::to_string(values.size()) + " values for " +
                                std::to_string(poses) + " poses");
  }
  const auto joints = static_cast<Eigen::Index>(values.size() / poses);
  std::vector<JointVector> seeds;
  for (std::size_t i = 0; i < poses; ++i) {
    seeds.emplace_back(
        Eigen::Map<const JointVector>(values.data() + static_cast<Eigen::Index>(i) * joints, joints));
  }
  return seeds;
}

/// Maps are kept as far as the robot reaches with what it holds: a typing error must not cost all plans.
void checkReach(double value, const std::string& what) {
  constexpr double kMaxM = 10.0;
  if (std::abs(value) <= kMaxM || std::isnan(value)) return;  // no numbers are refused where shapes are made
  std::ostringstream text;
  text << what << " is " << value << " m, at most " << kMaxM << " are allowed";
  throw std::invalid_argument(text.str());
}

fv_robot_model::Shape shapeFromMsg(const fv_msgs::AttachedObject& msg) {
  using fv_robot_model::Shape;
  const Eigen::Isometry3d T_link_shape = isometryFromMsg(msg.pose, "its pose");
  checkReach(T_link_shape.translation().cwiseAbs().maxCoeff(), "the distance of its centre from the link");
  for (const double size : {msg.dimensions.x, msg.dimensions.y, msg.dimensions.z})
    checkReach(size, "its size");
  switch (msg.kind) {
    case fv_msgs::AttachedObject::BOX:
      return Shape::box({msg.dimensions.x, msg.dimensions.y, msg.dimensions.z}, T_link_shape);
    case fv_msgs::AttachedObject::CYLINDER:
      return Shape::cylinder(msg.dimensions.x, msg.dimensions.y, T_link_shape);
    case fv_msgs::AttachedObject::SPHERE:
      return Shape::sphere(msg.dimensions.x, T_link_shape);
    default:
      throw std::invalid_argument("its kind is " + std::to_string(msg.kind) +
                                  "; valid: 0 (BOX), 1 (CYLINDER), 2 (SPHERE)");
  }
}

/// OctoMap reads its full format without looking at depths: broken data overflow its stack. A float and a
/// byte of children for each node, depth first. @throws std::invalid_argument unless the data are exactly one
/// tree.
void checkFullPayload(const std::vector<std::int8_t>& data) {
  constexpr std::size_t kNodeBytes = 5;
  constexpr std::size_t kDepth = 16;
  std::vector<std::size_t> to_come{1};  // nodes, by depth
  std::size_t at = 0;
  while (!to_come.empty()) {
    if (to_come.back() == 0) {
      to_come.pop_back();
      continue;
    }
    --to_come.back();
    if (at + kNodeBytes > data.size()) throw std::invalid_argument("map: its data are broken");
    const std::bitset<8> children(static_cast<std::uint8_t>(data[at + kNodeBytes - 1]));
    at += kNodeBytes;
    if (children.none()) continue;
    if (to_come.size() > kDepth)
      throw std::invalid_argument("map: its data are broken: deeper than 16 levels");
    to_come.push_back(children.count());
  }
  if (at != data.size()) throw std::invalid_argument("map: its data are broken: more comes after the tree");
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

VoxelGrid gridFromMsg(const fv_msgs::MapUpdate& msg, const Eigen::AlignedBox3d& region) {
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
  if (octomap.binary) {
    return VoxelGrid::fromBinaryPayload(octomap.data.data(), octomap.data.size(), octomap.resolution, region);
  }
  checkFullPayload(octomap.data);
  octomap::OcTree tree(octomap.resolution);
  std::stringstream stream(std::string(octomap.data.begin(), octomap.data.end()));
  tree.readData(stream);
  if (stream.fail() && !stream.eof()) throw std::invalid_argument("map: its data are broken");
  if (tree.size() == 0) throw std::invalid_argument("map: it has no voxels");
  return VoxelGrid::fromOctree(tree, region);
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
  request.exact_turns = msg.exact_turns;
  request.tip_link = msg.tip_link;
  for (std::size_t i = 0; i < msg.goal_poses.poses.size(); ++i) {
    request.goal_poses.push_back(isometryFromMsg(msg.goal_poses.poses[i], "goal pose " + std::to_string(i)));
  }
  request.goal_scores = msg.goal_scores;
  request.position_tolerance_m = msg.position_tolerance;
  request.angle_tolerance_rad = msg.angle_tolerance;
  request.free_roll = msg.free_roll;
  request.roll_axis = rollAxis(msg.roll_axis);
  request.goal_seeds = seedsFromList(msg.goal_seeds, msg.goal_poses.poses.size());
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
  checkNamedOnce(msg.name, "start");
  for (std::size_t i = 0; i < msg.name.size(); ++i) {
    if (!std::isfinite(msg.position[i])) {
      throw std::invalid_argument("start of joint '" + msg.name[i] + "' is not finite");
    }
    q_all[model.jointIndex(msg.name[i])] = msg.position[i];
  }
}

std::vector<HeldObject> heldObjectsFromMsg(const std::vector<fv_msgs::AttachedObject>& objects) {
  std::vector<HeldObject> held;
  for (const auto& object : objects) {
    try {
      held.push_back({object.name, object.link, object.touch_links, shapeFromMsg(object)});
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("object '" + object.name + "': " + error.what());
    }
  }
  return held;
}

std::string clipped(const std::string& text) {
  constexpr std::size_t kEnd = 400;
  if (text.size() <= 2 * kEnd) return text;
  return text.substr(0, kEnd) + " ... " + text.substr(text.size() - kEnd);
}

// The core's numbers are the message's; messages that were built from other sources would lie.
using Msg = fv_msgs::PlanMotionResult;
static_assert(static_cast<int>(PlanStatus::Success) == Msg::SUCCESS, "build fv_msgs anew");
static_assert(static_cast<int>(PlanStatus::InternalError) == Msg::INTERNAL_ERROR, "build fv_msgs anew");

fv_msgs::PlanMotionResult msgFromResult(const PlanResult& result) {
  fv_msgs::PlanMotionResult msg;
  msg.status = static_cast<std::uint8_t>(result.status);
  msg.message = clipped(result.message);
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
