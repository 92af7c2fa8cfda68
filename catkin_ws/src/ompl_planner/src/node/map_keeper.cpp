#include "map_keeper.h"

#include <chrono>
#include <stdexcept>

#include "conversions.h"
#include "ros_stopwatch.h"

namespace ompl_planner {
namespace {

constexpr std::size_t kKeptMaps = 12;  // a few MB each

}  // namespace

MapKeeper::MapKeeper(ros::NodeHandle& nh, const CurrentPlanner& planner, const RobotState& state)
    : planner_(planner), state_(state) {
  subscriber_ = nh.subscribe("/fv_exploration/map", 2, &MapKeeper::onMap, this);
}

void MapKeeper::onMap(const fv_msgs::MapUpdateConstPtr& msg) {
  std::optional<PlacedMap> placed;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_ = msg;
    place(*msg);
    if (!maps_.empty()) placed = maps_.back();
  }
  arrived_.notify_all();
  if (placed && on_placed_) on_placed_(*placed);
}

void MapKeeper::placeAgain() {
  std::optional<PlacedMap> placed;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!last_) return;
    maps_.clear();
    place(*last_);
    if (!maps_.empty()) placed = maps_.back();
  }
  if (placed && on_placed_) on_placed_(*placed);
}

/// Call with the mutex held. Leaves the message pending when it cannot be placed, with the reason.
void MapKeeper::place(const fv_msgs::MapUpdate& msg) {
  pending_ = true;
  try {
    if (msg.sequence == 0) throw std::invalid_argument("the explorer has no map yet (sequence 0)");
    PlacedMap placed;
    const auto planner = planner_.get();
    placed.frame = msg.header.frame_id;
    placed.stamp = msg.header.stamp;
    placed.T_map_root = state_.transform(placed.frame, planner->model().rootLink());
    placed.map.sequence = msg.sequence;
    placed.map.grid = std::make_shared<VoxelGrid>(gridFromMsg(msg, planner->reach(placed.T_map_root)));
    // An explorer that was restarted counts from 1 again: what came before belongs to another map.
    if (!maps_.empty() && msg.sequence < maps_.back().map.sequence) maps_.clear();
    if (!maps_.empty() && msg.sequence == maps_.back().map.sequence) maps_.pop_back();
    maps_.push_back(placed);
    if (maps_.size() > kKeptMaps) maps_.pop_front();
    pending_ = false;
    problem_.clear();
  } catch (const std::exception& error) {
    problem_ = error.what();
    maps_.clear();  // an older map would be a lie
    ROS_WARN_THROTTLE(5.0, "map not usable: %s", error.what());
  }
}

std::optional<PlacedMap> MapKeeper::latest(std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (pending_ && last_) place(*last_);
  why = problem_;
  if (maps_.empty()) return std::nullopt;
  return maps_.back();
}

std::optional<PlacedMap> MapKeeper::atLeast(std::uint64_t sequence, double wait_s,
                                            const std::function<bool()>& stop, std::string& why) {
  RosStopwatch stopwatch;
  while (true) {
    auto map = latest(why);
    const bool good = map && map->map.sequence >= sequence;
    if (good || sequence == 0 || stop() || stopwatch.elapsed() >= wait_s || !ros::ok()) return map;
    std::unique_lock<std::mutex> lock(mutex_);
    arrived_.wait_for(lock, std::chrono::milliseconds(10));  // then look at the ROS clock and at stop again
  }
}

std::optional<PlacedMap> MapKeeper::kept(std::uint64_t sequence) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const PlacedMap& map : maps_) {
    if (map.map.sequence == sequence) return map;
  }
  return std::nullopt;
}

}  // namespace ompl_planner
