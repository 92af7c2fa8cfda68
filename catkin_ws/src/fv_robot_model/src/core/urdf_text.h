/// The URDF's text as urdfdom's tree.
#pragma once

#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include <string>

namespace fv_robot_model {

/// @throws ModelError with what urdfdom complained about; urdfdom's own printing is kept off the terminal.
urdf::ModelInterfaceSharedPtr parseUrdfText(const std::string& xml);

}  // namespace fv_robot_model
