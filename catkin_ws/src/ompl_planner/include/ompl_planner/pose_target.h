/// Pose goals with tolerances and free roll, as rigid poses of the tip that inverse kinematics can solve.
#pragma once

#include <fv_robot_model/robot_model.h>

#include <Eigen/Geometry>
#include <random>

#include "ompl_planner/blended_path.h"

namespace ompl_planner {

/// What a joint state must satisfy to count as reaching a pose.
struct PoseTarget {
  Eigen::Isometry3d T_base_tool{Eigen::Isometry3d::Identity()};  ///< Wanted pose in the group's base frame.
  Eigen::Isometry3d T_tip_tool{Eigen::Isometry3d::Identity()};   ///< Tool frame on the group's tip.
  bool free_roll{false};                                         ///< Any rotation about roll_axis will do.
  Eigen::Vector3d roll_axis{Eigen::Vector3d::UnitZ()};           ///< Unit vector, tool frame.
  double position_tolerance_m{0.005};
  double angle_tolerance_rad{0.02};
};

/// Is T_base_tool reached at q?
bool reaches(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
             const PoseTarget& target, const JointVector& q);

/// T_base_tip that is the target itself; a free roll is chosen so that the tool turns least from T_base_near,
/// a pose of the tool, and then turned on by roll_rad.
Eigen::Isometry3d tipPoseAt(const PoseTarget& target, const Eigen::Isometry3d& T_base_near, double roll_rad);

/// As tipPoseAt, moved and tilted at random within the tolerances.
Eigen::Isometry3d tipPoseWithin(const PoseTarget& target, const Eigen::Isometry3d& T_base_near,
                                double roll_rad, std::mt19937_64& random);

}  // namespace ompl_planner
