/// Where the robot is: joint states and the transform of its root.
#pragma once

#include <fv_robot_model/robot_model.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <Eigen/Geometry>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace ompl_planner {

/// Keeps the latest value of every joint, whoever publishes it: messages may speak of some joints only, need
/// no velocities, and may name joints that the model has not. Thread-safe.
class RobotState {
 public:
  RobotState(ros::NodeHandle& nh, std::shared_ptr<const fv_robot_model::RobotModel> model, double timeout_s);

  /// All joints, as the model orders them. Empty, with the reason and all joints that it concerns in `why`,
  /// when joints of `needed` have not come yet, are older than the timeout (ROS time), or were useless in the
  /// last message that named them. Joints that never come and are not needed stand at 0, within their limits.
  std::optional<Eigen::VectorXd> joints(const std::vector<std::string>& needed, std::string& why) const;

  /// T_target_source, the latest known. @throws std::invalid_argument listing the known frames.
  Eigen::Isometry3d transform(const std::string& target, const std::string& source) const;

 private:
  void onJointState(const sensor_msgs::JointStateConstPtr& msg);
  std::string problemOf(std::size_t joint, const ros::Time& now) const;
  std::string knownFrames() const;  ///< Of TF, for messages.

  std::shared_ptr<const fv_robot_model::RobotModel> model_;
  double timeout_s_;
  mutable std::mutex mutex_;
  Eigen::VectorXd q_all_;
  std::vector<std::optional<ros::Time>> received_;  ///< By joint, ROS time.
  std::vector<std::string> useless_;  ///< By joint: why the last value cannot be used, or empty.
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  ros::Subscriber subscriber_;
};

}  // namespace ompl_planner
