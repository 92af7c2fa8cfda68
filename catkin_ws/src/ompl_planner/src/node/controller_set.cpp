#include "controller_set.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "ros_stopwatch.h"

namespace ompl_planner {
namespace {

std::ptrdiff_t positionOf(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : found - names.begin();
}

/// The columns of a trajectory that belong to a controller, in the controller's order.
trajectory_msgs::JointTrajectory partOf(const trajectory_msgs::JointTrajectory& whole,
                                        const Controller& controller) {
  trajectory_msgs::JointTrajectory part;
  part.joint_names = controller.joints;
  part.points.resize(whole.points.size());
  for (const std::string& joint : controller.joints) {
    const auto column = positionOf(whole.joint_names, joint);
    if (column < 0) {
      throw std::invalid_argument("controller '" + controller.action + "' also moves '" + joint +
                                  "', which the trajectory leaves out");
    }
    const auto c = static_cast<std::size_t>(column);
    for (std::size_t i = 0; i < whole.points.size(); ++i) {
      const auto& from = whole.points[i];
      auto& to = part.points[i];
      to.time_from_start = from.time_from_start;
      to.positions.push_back(from.positions[c]);
      if (!from.velocities.empty()) to.velocities.push_back(from.velocities[c]);
      if (!from.accelerations.empty()) to.accelerations.push_back(from.accelerations[c]);
    }
  }
  return part;
}

void noteErrors(const control_msgs::FollowJointTrajectoryFeedback& feedback, std::atomic<double>& largest) {
  for (const double error : feedback.error.positions) {
    double known = largest;
    while (std::abs(error) > known && !largest.compare_exchange_weak(known, std::abs(error))) {
    }
  }
}

}  // namespace

void ControllerSet::assign(const trajectory_msgs::JointTrajectory& trajectory) {
  std::vector<std::string> left = trajectory.joint_names;
  for (std::size_t i = 0; i < clients_.controllers().size(); ++i) {
    const Controller& controller = clients_.controllers()[i];
    const auto before = left.size();
    for (const std::string& joint : controller.joints)
      left.erase(std::remove(left.begin(), left.end(), joint), left.end());
    if (left.size() == before) continue;
    Part part{};
    part.action = controller.action;
    part.controller = i;
    part.goal.trajectory = partOf(trajectory, controller);
    parts_.push_back(std::move(part));
  }
  if (!left.empty())
    throw std::invalid_argument("no controller of /controller_list moves joint '" + left.front() + "'");
}

bool ControllerSet::connect(double wait_s, const std::function<bool()>& stop, std::string& why) {
  while (!ros::Time::isValid()) {
    why = "the clock has not started";
    if (stop()) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  for (Part& part : parts_) part.client = &clients_.client(part.controller);
  RosStopwatch stopwatch;
  for (Part& part : parts_) {
    while (!part.client->isServerConnected()) {
      if (stop() || stopwatch.elapsed() >= wait_s) {
        why = "controller '" + part.action + "' does not answer";
        return false;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  return true;
}

void ControllerSet::send() {
  using Client = ControllerClients::Client;
  const auto on_feedback = [max_error = max_error_](const auto& feedback) {
    noteErrors(*feedback, *max_error);
  };
  for (Part& part : parts_) {
    part.client->sendGoal(part.goal, Client::SimpleDoneCallback(), Client::SimpleActiveCallback(),
                          on_feedback);
  }
  sent_ = true;
}

ControllerSet::Outcome ControllerSet::outcome(std::string& why) const {
  bool all_succeeded = true;
  for (const Part& part : parts_) {
    const auto state = part.client->getState();
    if (state == actionlib::SimpleClientGoalState::SUCCEEDED) continue;
    all_succeeded = false;
    if (!state.isDone()) continue;
    const auto result = part.client->getResult();
    why = "controller '" + part.action + "' ended " + state.toString() +
          (result ? ": " + result->error_string + " (code " + std::to_string(result->error_code) + ")" : "");
    return Outcome::Failed;
  }
  return all_succeeded ? Outcome::Succeeded : Outcome::Running;
}

void ControllerSet::cancelAll() {
  if (!sent_) return;
  for (Part& part : parts_) {
    if (!part.client->getState().isDone()) part.client->cancelGoal();
  }
}

bool ControllerSet::connected(std::string& why) const {
  if (!sent_) return true;
  for (const Part& part : parts_) {
    if (part.client->isServerConnected()) continue;
    why = "controller '" + part.action + "' went away";
    return false;
  }
  return true;
}

bool ControllerSet::allDone() const {
  if (!sent_) return true;
  return std::all_of(parts_.begin(), parts_.end(),
                     [](const Part& part) { return part.client->getState().isDone(); });
}

}  // namespace ompl_planner
