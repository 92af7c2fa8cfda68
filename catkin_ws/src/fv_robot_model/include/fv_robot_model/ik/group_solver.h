/// Inverse kinematics for a group of a RobotModel.
#pragma once

#include <memory>
#include <string>

#include "fv_robot_model/ik/ik_solver.h"
#include "fv_robot_model/robot_model.h"

namespace fv_robot_model::ik {

/// The group's joints as a SerialChain from its base link to its tip link, with the URDF's limits (continuous
/// joints: -pi to pi). Joint order as in Group::joint_indices. With mimic joints in it the chain isCoupled().
/// @throws ModelError when the group is no chain; std::invalid_argument when it has no moving joint;
///         UnknownNameError for an unknown group.
SerialChain chainOfGroup(const RobotModel& model, const std::string& group);

/// makeIkSolver(chainOfGroup(model, group), options): poses are T_base_tip of the group.
std::unique_ptr<IkSolver> makeIkSolver(const RobotModel& model, const std::string& group,
                                       const IkOptions& options = {});

}  // namespace fv_robot_model::ik
