#include "node_params.h"

#include <XmlRpcValue.h>
#include <ros/names.h>
#include <ros/package.h>

#include <stdexcept>

#include "request_check.h"

namespace ompl_planner {
namespace {

using XmlRpc::XmlRpcValue;

std::string requiredText(const ros::NodeHandle& nh, const std::string& name) {
  std::string text;
  if (!nh.getParam(name, text) || text.empty()) {
    throw std::runtime_error("parameter '" + name + "' is missing: upload a robot first");
  }
  return text;
}

double toNumber(XmlRpcValue value, const std::string& name) {
  if (value.getType() == XmlRpcValue::TypeDouble) return static_cast<double>(value);
  if (value.getType() == XmlRpcValue::TypeInt) return static_cast<int>(value);
  throw std::invalid_argument("parameter '" + name + "' must be a number");
}

ConfigValue toConfigValue(const XmlRpcValue& value, const std::string& name) {
  XmlRpcValue copy = value;  // XmlRpcValue's conversions are not const
  if (copy.getType() == XmlRpcValue::TypeString) return static_cast<std::string>(copy);
  if (copy.getType() == XmlRpcValue::TypeBoolean) return static_cast<bool>(copy);
  return toNumber(copy, name);
}

double rate(XmlRpcValue& joint, const std::string& name, const std::string& kind) {
  const std::string flag = "has_" + kind + "_limits";
  const std::string member = "max_" + kind;
  if (!joint.hasMember(flag) || !static_cast<bool>(joint[flag])) return 0.0;
  if (!joint.hasMember(member)) throw std::invalid_argument("joint limits of '" + name + "' lack " + member);
  const double value = toNumber(joint[member], name + "/" + member);
  if (!(value > 0.0))
    throw std::invalid_argument("joint limits of '" + name + "': " + member + " must be positive");
  return value;
}

std::map<std::string, JointRates> readRates(const ros::NodeHandle& nh) {
  std::map<std::string, JointRates> rates;
  XmlRpcValue limits;
  if (!nh.getParam("robot_description_planning/joint_limits", limits)) return rates;
  for (auto& [name, joint] : limits) {
    rates[name] = {rate(joint, name, "velocity"), rate(joint, name, "acceleration")};
  }
  return rates;
}

std::vector<Controller> readControllers(const ros::NodeHandle& nh) {
  std::vector<Controller> controllers;
  XmlRpcValue list;
  if (!nh.getParam("controller_list", list)) return controllers;
  for (int i = 0; i < list.size(); ++i) {
    XmlRpcValue& entry = list[i];
    if (!entry.hasMember("name") || !entry.hasMember("joints")) {
      throw std::invalid_argument("controller_list[" + std::to_string(i) + "] lacks name or joints");
    }
    Controller controller;
    const std::string name = static_cast<std::string>(entry["name"]);
    const std::string action = entry.hasMember("action_ns") ? static_cast<std::string>(entry["action_ns"])
                                                            : "follow_joint_trajectory";
    controller.action = ros::names::append(name[0] == '/' ? name : "/" + name, action);
    for (int j = 0; j < entry["joints"].size(); ++j) {
      controller.joints.push_back(static_cast<std::string>(entry["joints"][j]));
    }
    checkNamedOnce(controller.joints, "controller '" + name + "' of controller_list");
    controllers.push_back(controller);
  }
  std::vector<std::string> joints;
  for (const Controller& controller : controllers)
    joints.insert(joints.end(), controller.joints.begin(), controller.joints.end());
  checkNamedOnce(joints, "controller_list");
  return controllers;
}

/// Takes the node's own values out of the map; the planner's stay.
void takeNodeConfig(std::map<std::string, ConfigValue>& values, NodeConfig& config) {
  const std::map<std::string, double NodeConfig::*> fields{
      {"joint_state_timeout_s", &NodeConfig::joint_state_timeout_s},
      {"map_wait_s", &NodeConfig::map_wait_s},
      {"controller_wait_s", &NodeConfig::controller_wait_s},
      {"settle_s", &NodeConfig::settle_s}};
  for (const auto& [name, member] : fields) {
    const auto found = values.find(name);
    if (found == values.end()) continue;
    const double* number = std::get_if<double>(&found->second);
    if (number == nullptr || !(*number >= 0.0)) {
      throw std::invalid_argument("parameter '" + name + "' must be a number, not negative");
    }
    config.*member = *number;
    values.erase(found);
  }
}

std::string packageFile(const std::string& uri) {
  const std::string rest = uri.substr(std::string("package://").size());
  const auto slash = rest.find('/');
  return ros::package::getPath(rest.substr(0, slash)) + rest.substr(slash);
}

}  // namespace

NodeParams readNodeParams(const ros::NodeHandle& global, const ros::NodeHandle& priv) {
  NodeParams params;
  const auto resolver = [](const std::string& uri) {
    return uri.rfind("package://", 0) == 0 ? packageFile(uri) : std::string();
  };
  params.model = std::make_shared<fv_robot_model::RobotModel>(
      fv_robot_model::RobotModel::fromXml(requiredText(global, "robot_description"),
                                          requiredText(global, "robot_description_semantic"), resolver));
  for (const std::string& link : params.model->bareLinks()) {
    ROS_WARN("link '%s' has no <collision>: no plan keeps it clear of anything", link.c_str());
  }
  params.rates = readRates(global);
  params.controllers = readControllers(global);
  XmlRpcValue own;
  std::map<std::string, ConfigValue> values;
  if (priv.getParam(priv.getNamespace(), own) && own.getType() == XmlRpcValue::TypeStruct) {
    for (auto& [name, value] : own) values[name] = toConfigValue(value, name);
  }
  takeNodeConfig(values, params.node);
  params.planner.set(values);
  return params;
}

}  // namespace ompl_planner
