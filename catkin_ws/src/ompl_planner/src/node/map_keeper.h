/// The latest map, as the planner needs it.
#pragma once

#include <fv_msgs/MapUpdate.h>
#include <ros/ros.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "current_planner.h"
#include "ompl_planner/plan_types.h"
#include "robot_state.h"

namespace ompl_planner {

/// A snapshot and where it stands.
struct PlacedMap {
  MapSnapshot map;
  std::string frame;
  ros::Time stamp;
  Eigen::Isometry3d T_map_root{Eigen::Isometry3d::Identity()};
};

/// Turns each map message into a dense snapshot; keeps the last few, to tell what changed since a plan.
/// Thread-safe; snapshots are immutable, so planning reads one while the next map comes in.
class MapKeeper {
 public:
  MapKeeper(ros::NodeHandle& nh, const CurrentPlanner& planner, const RobotState& state);

  /// Called with each new map, in the thread that received it. Set it before maps come.
  void onPlaced(std::function<void(const PlacedMap&)> callback) { on_placed_ = std::move(callback); }

  /// The robot reaches further, or less far, than before: the latest message is placed anew, older maps go.
  void placeAgain();

  /// The latest map; empty, with the reason in `why`, when there is none.
  std::optional<PlacedMap> latest(std::string& why);
  /// As latest, after waiting up to wait_s of ROS time for a map of at least this sequence number; may return
  /// an older one.
  std::optional<PlacedMap> atLeast(std::uint64_t sequence, double wait_s, const std::function<bool()>& stop,
                                   std::string& why);
  /// A map that was received before; empty when it is no longer kept.
  std::optional<PlacedMap> kept(std::uint64_t sequence) const;

 private:
  void onMap(const fv_msgs::MapUpdateConstPtr& msg);
  void place(const fv_msgs::MapUpdate& msg);

  const CurrentPlanner& planner_;
  const RobotState& state_;
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<PlacedMap> maps_;  ///< Oldest first.
  std::function<void(const PlacedMap&)> on_placed_;
  fv_msgs::MapUpdateConstPtr last_;  ///< The newest message.
  bool pending_{false};              ///< It came before the robot's place was known.
  std::string problem_{"no map has been received yet"};
  ros::Subscriber subscriber_;
};

}  // namespace ompl_planner
