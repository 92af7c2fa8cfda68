/// Does what changed in the map meet a motion that was planned before?
#pragma once

#include <fv_robot_model/robot_model.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ompl_planner/config.h"
#include "ompl_planner/time_parameterization.h"
#include "ompl_planner/voxel_grid.h"

namespace ompl_planner {

/// The group that has exactly these joints, in this order; one of the model's where its joints are the same,
/// else one without name and chain. @throws fv_robot_model::UnknownNameError, std::invalid_argument when a
/// joint comes twice.
fv_robot_model::Group groupOfJoints(const fv_robot_model::RobotModel& model,
                                    const std::vector<std::string>& joints);

/// A grid that is free but for the voxels that differ between two maps and are not free in the newer one.
/// @throws std::invalid_argument when the maps do not cover the same voxels.
VoxelGrid changedObstacles(const VoxelGrid& older, const VoxelGrid& newer);

/// What of `obstacles` the trajectory meets from from_s on; empty when nothing.
/// @param q_all Values of all joints; those of the group are replaced by the trajectory's.
std::string obstacleOnTheWay(const fv_robot_model::RobotModel& model, const fv_robot_model::Group& group,
                             const Eigen::VectorXd& q_all, const Eigen::Isometry3d& T_map_root,
                             std::shared_ptr<const VoxelGrid> obstacles, const PlannerConfig& config,
                             const TimedTrajectory& trajectory, double from_s);

}  // namespace ompl_planner
