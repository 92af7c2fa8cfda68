/// Which part of the map can a robot touch at all?
#pragma once

#include <fv_robot_model/robot_model.h>

namespace ompl_planner {

/// Box in the map frame that the links of a group cannot leave while the other joints stay [m].
Eigen::AlignedBox3d groupReach(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                               const fv_robot_model::LinkPoses& poses, const Eigen::Isometry3d& T_map_root);

/// Box in the map frame that no link of the robot can leave, whatever the joints do [m].
Eigen::AlignedBox3d robotReach(const fv_robot_model::RobotModel& model, const Eigen::Isometry3d& T_map_root);

}  // namespace ompl_planner
