/// The controllers that share one trajectory.
#pragma once

#include <actionlib/client/simple_action_client.h>
#include <control_msgs/FollowJointTrajectoryAction.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "node_params.h"

namespace ompl_planner {

/// The robot's controllers and a client for each, which stays once it was made: to connect anew for each
/// motion takes longer than many a motion's start should, and sometimes seconds.
class ControllerClients {
 public:
  using Client = actionlib::SimpleActionClient<control_msgs::FollowJointTrajectoryAction>;

  explicit ControllerClients(const std::vector<Controller>& controllers)
      : controllers_(controllers), clients_(controllers.size()) {}
  const std::vector<Controller>& controllers() const { return controllers_; }

  /// Made when first asked for: its constructor blocks until the clock has started.
  Client& client(std::size_t controller) {
    auto& client = clients_[controller];
    if (!client) client = std::make_unique<Client>(controllers_[controller].action, /*spin_thread=*/true);
    return *client;
  }

 private:
  std::vector<Controller> controllers_;
  std::vector<std::unique_ptr<Client>> clients_;
};

/// Sends the parts of a trajectory to the controllers of its joints at the same moment and watches them. One
/// at a time.
class ControllerSet {
 public:
  explicit ControllerSet(ControllerClients& clients) : clients_(clients) {}

  /// Cancels what still runs.
  ~ControllerSet() { cancelAll(); }

  enum class Outcome { Running, Succeeded, Failed };

  /// Splits the trajectory. @throws std::invalid_argument naming a joint that no controller moves, and a
  /// joint of a needed
  ///   controller that the trajectory leaves out: a controller takes all of its joints or none.
  void assign(const trajectory_msgs::JointTrajectory& trajectory);

  /// @return False, with the reason, when a controller's action server does not answer within wait_s of ROS
  /// time or `stop` fires.
  bool connect(double wait_s, const std::function<bool()>& stop, std::string& why);

  /// Sends all goals, one right after the other, with stamp 0: start at once.
  void send();

  /// Failed as soon as one has failed, with the reason.
  Outcome outcome(std::string& why) const;

  void cancelAll();
  bool allDone() const;
  /// Have goals been sent?
  bool sent() const { return sent_; }
  /// False, with the reason, when the action server of a goal that was sent is gone.
  bool connected(std::string& why) const;

  /// Largest absolute position error that any controller has reported [rad].
  double maxTrackingError() const { return *max_error_; }

 private:
  struct Part {
    std::string action;
    control_msgs::FollowJointTrajectoryGoal goal;
    std::size_t controller;
    ControllerClients::Client* client;  ///< Once connected.
  };

  ControllerClients& clients_;
  std::vector<Part> parts_;
  std::shared_ptr<std::atomic<double>> max_error_{
      std::make_shared<std::atomic<double>>(0.0)};  ///< Of callbacks too.
  bool sent_{false};
};

}  // namespace ompl_planner
