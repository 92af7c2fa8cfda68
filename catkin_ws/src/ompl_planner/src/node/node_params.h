/// What the node reads from the parameter server at start.
#pragma once

#include <fv_robot_model/robot_model.h>
#include <ros/node_handle.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ompl_planner/config.h"
#include "ompl_planner/motion_planner.h"

namespace ompl_planner {

/// Parameters of the node itself, beside those of the planner.
struct NodeConfig {
  double joint_state_timeout_s{1.0};  ///< Older joint states are refused [s of ROS time].
  double map_wait_s{2.0};             ///< A plan waits this long for min_map_sequence [s].
  double controller_wait_s{3.0};      ///< Execution waits this long for controllers [s].
  double settle_s{2.0};  ///< Controllers may answer this much after the motion's end [s of ROS time].
};

/// One entry of /controller_list.
struct Controller {
  std::string action;  ///< Name of its FollowJointTrajectory action.
  std::vector<std::string> joints;
};

struct NodeParams {
  std::shared_ptr<const fv_robot_model::RobotModel> model;
  std::map<std::string, JointRates> rates;
  std::vector<Controller> controllers;
  PlannerConfig planner;
  NodeConfig node;
};

/// @throws std::runtime_error or std::invalid_argument naming the parameter that is missing or wrong.
NodeParams readNodeParams(const ros::NodeHandle& global, const ros::NodeHandle& priv);

}  // namespace ompl_planner
