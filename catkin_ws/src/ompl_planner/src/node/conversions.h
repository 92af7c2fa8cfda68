/// Messages to core types and back. Pure: no node, no parameter, no clock.
#pragma once

#include <fv_msgs/AttachedObject.h>
#include <fv_msgs/MapUpdate.h>
#include <fv_msgs/PlanMotionAction.h>
#include <fv_robot_model/robot_model.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <trajectory_msgs/JointTrajectory.h>

#include <memory>

#include "ompl_planner/motion_planner.h"
#include "ompl_planner/plan_types.h"

namespace ompl_planner {

/// @throws std::invalid_argument for values that are not finite or a quaternion whose norm is not 1 within 1
/// %.
Eigen::Isometry3d isometryFromMsg(const geometry_msgs::Pose& pose, const std::string& what);
Eigen::Isometry3d isometryFromMsg(const geometry_msgs::Transform& transform);
geometry_msgs::Pose msgFromIsometry(const Eigen::Isometry3d& T);

/// The part of a message's octree, binary or full, that lies in a region.
/// @throws std::invalid_argument for another tree type, a resolution that is not positive, broken data, a
/// tree without voxels, or frames that contradict each other.
VoxelGrid gridFromMsg(const fv_msgs::MapUpdate& msg, const Eigen::AlignedBox3d& region);

/// All fields but those that need the robot's state or TF: start, map, transform and the frame of the poses,
/// which are taken as they stand in the message.
/// @throws std::invalid_argument for unknown enum values, lists of unequal length, goals of more than one
/// type.
PlanRequest requestFromMsg(const fv_msgs::PlanMotionGoal& msg);

/// Overwrites the values of the joints that the message names.
/// @throws std::invalid_argument for unequal lengths, values that are not finite; UnknownNameError for
/// joints.
void overlayJoints(const sensor_msgs::JointState& msg, const fv_robot_model::RobotModel& model,
                   Eigen::VectorXd& q_all);

/// @throws std::invalid_argument naming the object: unknown kind, sizes that are not positive, broken poses.
std::vector<HeldObject> heldObjectsFromMsg(const std::vector<fv_msgs::AttachedObject>& objects);

/// A text of bearable length: of long ones the first and the last 400 bytes. Somebody's joint name may be
/// megabytes.
std::string clipped(const std::string& text);

fv_msgs::PlanMotionResult msgFromResult(const PlanResult& result);

trajectory_msgs::JointTrajectory msgFromTrajectory(const TimedTrajectory& trajectory,
                                                   const std::vector<std::string>& joint_names);
/// @throws std::invalid_argument for points without positions, of wrong size, not finite, or times that do
/// not ascend.
///   Velocities and accelerations that are left out count as zero.
TimedTrajectory trajectoryFromMsg(const trajectory_msgs::JointTrajectory& msg);

}  // namespace ompl_planner
