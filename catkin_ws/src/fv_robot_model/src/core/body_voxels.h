/// The space that the robot's body fills.
#pragma once

#include <Eigen/Geometry>

#include "fv_robot_model/robot_model.h"

namespace fv_robot_model {

/// Voxels that meet the body: where a robot stands, nothing else is, so that space is known to be free of
/// scene.
/// @param poses T_root_link as RobotModel::forward gives them. @param T_map_root Root frame to map frame.
/// @param resolution_m Edge of a voxel; voxel k spans [k, k + 1) * resolution on each axis, as OctoMap's.
/// @param padding_m The body grows by this much.
/// @return (V, 3) centres, map frame [m], each once, ordered by x, then y, then z. Empty for a robot without
/// shapes.
/// @throws std::invalid_argument for poses that do not fit or are not finite, resolution <= 0, padding < 0,
/// or a
///   body of more than 50 million voxels.
Points bodyVoxels(const RobotModel& model, const LinkPoses& poses, const Eigen::Isometry3d& T_map_root,
                  double resolution_m, double padding_m);

}  // namespace fv_robot_model
