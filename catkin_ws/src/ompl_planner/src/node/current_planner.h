/// The planner for the robot as it is now, with what it holds.
#pragma once

#include <fv_msgs/SetAttachedObjects.h>
#include <ros/ros.h>

#include <functional>
#include <memory>
#include <mutex>

#include "ompl_planner/motion_planner.h"

namespace ompl_planner {

/// Owns the planner; the service /ompl_planner/set_attached_objects puts one in its place that knows what the
/// robot holds, and /ompl_planner/attached_objects (latched) tells everyone. Who is planning or watching a
/// motion goes on with the planner that it took. Thread-safe.
class CurrentPlanner {
 public:
  CurrentPlanner(ros::NodeHandle& nh, std::shared_ptr<const MotionPlanner> empty_handed);

  std::shared_ptr<const MotionPlanner> get() const;

  /// Called after the robot has taken or let go of something. Set it before the node spins.
  void onChange(std::function<void()> callback) { on_change_ = std::move(callback); }

 private:
  bool onSet(fv_msgs::SetAttachedObjects::Request& request, fv_msgs::SetAttachedObjects::Response& response);

  std::shared_ptr<const MotionPlanner> empty_handed_;
  mutable std::mutex mutex_;
  std::shared_ptr<const MotionPlanner> planner_;
  std::function<void()> on_change_;
  ros::Publisher publisher_;
  ros::ServiceServer service_;
};

}  // namespace ompl_planner
