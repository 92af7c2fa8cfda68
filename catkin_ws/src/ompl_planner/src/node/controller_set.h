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

/// Sends the parts of a trajectory to the controllers of its joints at the same moment and watches them.
class ControllerSet {
 public:
  explicit ControllerSet(const std::vector<Controller>& controllers) : controllers_(controllers) {}

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
  /// Do the action servers of all goals that were sent still answer?
  bool connected() const;

  /// Largest absolute position error that any controller has reported [rad].
  double maxTrackingError() const { return max_error_; }

 private:
  using Client = actionlib::SimpleActionClient<control_msgs::FollowJointTrajectoryAction>;
  struct Part {
    std::string action;
    control_msgs::FollowJointTrajectoryGoal goal;
    std::unique_ptr<Client> client;
  };
  void onFeedback(const control_msgs::FollowJointTrajectoryFeedbackConstPtr& feedback);

  std::vector<Controller> controllers_;
  std::vector<Part> parts_;
  std::atomic<double> max_error_{0.0};
  bool sent_{false};
};

}  // namespace ompl_planner
