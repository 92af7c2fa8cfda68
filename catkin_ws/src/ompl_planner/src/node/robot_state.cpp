#include "robot_state.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>
#include <stdexcept>

#include "conversions.h"

namespace ompl_planner {

RobotState::RobotState(ros::NodeHandle& nh, std::shared_ptr<const fv_robot_model::RobotModel> model,
                       double timeout_s)
    : model_(std::move(model)),
      timeout_s_(timeout_s),
      q_all_(static_cast<Eigen::Index>(model_->jointNames().size())),
      received_(model_->jointNames().size()),
      useless_(model_->jointNames().size()),
      listener_(buffer_) {
  buffer_.setUsingDedicatedThread(true);
  for (Eigen::Index i = 0; i < q_all_.size(); ++i) {
    const auto& limits = model_->limits()[static_cast<std::size_t>(i)];
    q_all_[i] = limits.bounded ? std::clamp(0.0, limits.lower, limits.upper) : 0.0;
  }
  subscriber_ = nh.subscribe("/joint_states", 20, &RobotState::onJointState, this);
}

void RobotState::onJointState(const sensor_msgs::JointStateConstPtr& msg) {
  if (msg->position.empty()) return;  // velocities or efforts alone
  const ros::Time now = ros::Time::now();
  const auto& names = model_->jointNames();
  std::map<std::string, int> times_named;
  for (const std::string& name : msg->name) ++times_named[name];
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < msg->name.size(); ++i) {
    const auto found = std::find(names.begin(), names.end(), msg->name[i]);
    if (found == names.end()) continue;
    const auto index = static_cast<std::size_t>(found - names.begin());
    std::string& useless = useless_[index];
    useless.clear();
    if (msg->name.size() != msg->position.size()) {
      useless = "comes in a message of " + std::to_string(msg->name.size()) + " names and " +
                std::to_string(msg->position.size()) + " positions";
    } else if (times_named[msg->name[i]] > 1) {
      useless = "is named more than once in one message";
    } else if (!std::isfinite(msg->position[i])) {
      useless = "is not finite";
    } else {
      q_all_[static_cast<Eigen::Index>(index)] = msg->position[i];
      received_[index] = now;
    }
  }
}

/// Why the value of one joint cannot be used; empty when it can.
std::string RobotState::problemOf(std::size_t joint, const ros::Time& now) const {
  if (!useless_[joint].empty()) return useless_[joint];
  if (!received_[joint]) return "has not come yet";
  // A clock that jumped back makes the age negative: then only a new message tells where the robot is.
  const double age = (now - *received_[joint]).toSec();
  if (std::abs(age) <= timeout_s_) return {};
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "is " << age << " s old";
  return text.str();
}

std::optional<Eigen::VectorXd> RobotState::joints(const std::vector<std::string>& needed,
                                                  std::string& why) const {
  const ros::Time now = ros::Time::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<std::string, std::string> joints_by_problem;
  for (const std::string& joint : needed) {
    const std::string problem = problemOf(static_cast<std::size_t>(model_->jointIndex(joint)), now);
    if (problem.empty()) continue;
    std::string& joints = joints_by_problem[problem];
    joints += (joints.empty() ? "'" : ", '") + joint + "'";
  }
  if (joints_by_problem.empty()) return q_all_;
  why.clear();
  for (const auto& [problem, joints] : joints_by_problem) {
    why += (why.empty() ? "/joint_states: that of " : "; that of ") + joints + " " + problem;
  }
  return std::nullopt;
}

std::string RobotState::knownFrames() const {
  std::vector<std::string> frames;
  buffer_._getFrameStrings(frames);
  std::sort(frames.begin(), frames.end());
  std::string text;
  for (const auto& frame : frames) text += (text.empty() ? "" : ", ") + frame;
  return text.empty() ? "none" : text;
}

Eigen::Isometry3d RobotState::transform(const std::string& target, const std::string& source) const {
  if (target == source) return Eigen::Isometry3d::Identity();
  try {
    return isometryFromMsg(buffer_.lookupTransform(target, source, ros::Time(0)).transform);
  } catch (const tf2::TransformException& error) {
    throw std::invalid_argument("no transform from '" + source + "' to '" + target +
                                "'; known frames: " + knownFrames());
  }
}

}  // namespace ompl_planner
