/// Shows motions to viewers: when they are planned, and again when they begin.
#pragma once

#include <fv_msgs/PlannedPath.h>
#include <fv_robot_model/robot_model.h>
#include <ros/ros.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

namespace ompl_planner {

/// A trajectory and what it takes to draw it.
struct ShownPath {
  const trajectory_msgs::JointTrajectory& trajectory;
  const fv_robot_model::RobotModel& model;
  const fv_robot_model::Group& group;  ///< Of the trajectory's joints, in its order.
  const Eigen::VectorXd& q_all;        ///< Where the other joints are.
  std::string frame;                   ///< Of the drawing.
  Eigen::Isometry3d T_frame_root;
  std::uint64_t map_sequence;  ///< 0: planned on no map.
  bool executing;
};

/// Publishes /ompl_planner/path, latched. Thread-safe.
class PathPublisher {
 public:
  explicit PathPublisher(ros::NodeHandle& nh)
      : publisher_(nh.advertise<fv_msgs::PlannedPath>("/ompl_planner/path", 1, /*latch=*/true)) {}

  void publish(const ShownPath& path) const;

 private:
  ros::Publisher publisher_;
};

}  // namespace ompl_planner
