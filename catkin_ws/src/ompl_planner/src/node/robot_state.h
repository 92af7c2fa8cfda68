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

/// Keeps the latest value of every joint. Thread-safe.
class RobotState {
 public:
  RobotState(ros::NodeHandle& nh, std::shared_ptr<const fv_robot_model::RobotModel> model, double timeout_s);

  /// All joints, as the model orders them. Empty, with the reason in `why`, when a joint of `needed` has not
  /// come yet or is older than the timeout (ROS time). Joints that never come and are not needed stand at 0,
  /// within their limits.
  std::optional<Eigen::VectorXd> joints(const std::vector<std::string>& needed, std::string& why) const;

  /// T_target_source, the latest known. @throws std::invalid_argument listing the known frames.
  Eigen::Isometry3d transform(const std::string& target, const std::string& source) const;

 private:
  void onJointState(const sensor_msgs::JointStateConstPtr& msg);

  std::shared_ptr<const fv_robot_model::RobotModel> model_;
  double timeout_s_;
  mutable std::mutex mutex_;
  Eigen::VectorXd q_all_;
  std::vector<std::optional<ros::Time>> received_;  ///< By joint, ROS time.
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  ros::Subscriber subscriber_;
};

}  // namespace ompl_planner
