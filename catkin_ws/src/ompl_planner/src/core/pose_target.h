/// Pose goals with tolerances and free roll, as rigid poses of the tip that inverse kinematics can solve.
#pragma once

#include <fv_robot_model/ik/pose_target.h>

#include <Eigen/Geometry>
#include <random>

namespace ompl_planner {

using fv_robot_model::ik::PoseTarget;

/// T_base_tip that is the target itself; a free roll is chosen so that the tool turns least from T_base_near,
/// a pose of the tool, and then turned on by roll_rad.
Eigen::Isometry3d tipPoseAt(const PoseTarget& target, const Eigen::Isometry3d& T_base_near, double roll_rad);

/// As tipPoseAt, moved and tilted at random within the tolerances.
Eigen::Isometry3d tipPoseWithin(const PoseTarget& target, const Eigen::Isometry3d& T_base_near,
                                double roll_rad, std::mt19937_64& random);

}  // namespace ompl_planner
