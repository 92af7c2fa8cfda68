#include "robot_state.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "conversions.h"

namespace ompl_planner {

RobotState::RobotState(ros::NodeHandle& nh, std::shared_ptr<const fv_robot_model::RobotModel> model,
                       double timeout_s)
    : model_(std::move(model)),
      timeout_s_(timeout_s),
      q_all_(static_cast<Eigen::Index>(model_->jointNames().size())),
      received_(model_->jointNames().size()),
      listener_(buffer_) {
  buffer_.setUsingDedicatedThread(true);
  for (Eigen::Index i = 0; i < q_all_.size(); ++i) {
    const auto& limits = model_->limits()[static_cast<std::size_t>(i)];
    q_all_[i] = limits.bounded ? std::clamp(0.0, limits.lower, limits.upper) : 0.0;
  }
  subscriber_ = nh.subscribe("/joint_states", 20, &RobotState::onJointState, this);
}

void RobotState::onJointState(const sensor_msgs::JointStateConstPtr& msg) {
  const ros::Time now = ros::Time::now();
  const auto& names = model_->jointNames();
  const std::size_t count = std::min(msg->name.size(), msg->position.size());
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = std::find(names.begin(), names.end(), msg->name[i]);
    if (found == names.end() || !std::isfinite(msg->position[i])) continue;
    const auto index = static_cast<std::size_t>(found - names.begin());
    q_all_[static_cast<Eigen::Index>(index)] = msg->position[i];
    received_[index] = now;
  }
}

std::optional<Eigen::VectorXd> RobotState::joints(const std::vector<std::string>& needed,
                                                  std::string& why) const {
  const ros::Time now = ros::Time::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::string& joint : needed) {
    const auto& received = received_[static_cast<std::size_t>(model_->jointIndex(joint))];
    if (!received) {
      why = "no joint state of '" + joint + "' has come yet";
      return std::nullopt;
    }
    // A clock that jumped back makes the age negative: then only a new message tells where the robot is.
    const double age = (now - *received).toSec();
    if (age > timeout_s_ || age < -timeout_s_) {
      why = "the last joint state of '" + joint + "' is " + std::to_string(age) + " s old";
      return std::nullopt;
    }
  }
  return q_all_;
}

Eigen::Isometry3d RobotState::transform(const std::string& target, const std::string& source) const {
  if (target == source) return Eigen::Isometry3d::Identity();
  try {
    return isometryFromMsg(buffer_.lookupTransform(target, source, ros::Time(0)).transform);
  } catch (const tf2::TransformException& error) {
    throw std::invalid_argument("no transform from '" + source + "' to '" + target +
                                "'; known frames: " + buffer_.allFramesAsString());
  }
}

}  // namespace ompl_planner
