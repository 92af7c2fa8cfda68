/// The motions that this node has planned, by number: who wants one executed need not send it back.
#pragma once

#include <trajectory_msgs/JointTrajectory.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <utility>

#include "ompl_planner/time_parameterization.h"

namespace ompl_planner {

/// A motion that can be executed.
struct PlannedMotion {
  TimedTrajectory trajectory;
  trajectory_msgs::JointTrajectory message;  ///< The same, for controllers and viewers.
  std::uint64_t map_sequence{0};             ///< Of the map that it was planned on; 0: maps are not checked.
};

using PlannedMotionPtr = std::shared_ptr<const PlannedMotion>;

/// Keeps the last of them. Thread-safe.
class KeptPlans {
 public:
  static constexpr std::size_t kKept = 256;

  /// @param first Number of the first motion, above 0; one that no earlier life of the node has given, for
  /// somebody may still know that.
  explicit KeptPlans(std::uint64_t first) : next_(first) {}

  /// @return The motion's number.
  std::uint64_t keep(PlannedMotionPtr motion) {
    const std::lock_guard<std::mutex> lock(mutex_);
    motions_.push_back(std::move(motion));
    if (motions_.size() > kKept) motions_.pop_front();
    return next_++;
  }

  /// Null: no motion has this number (any more).
  PlannedMotionPtr get(std::uint64_t number) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::uint64_t oldest = next_ - motions_.size();
    return number < oldest || number >= next_ ? nullptr : motions_[number - oldest];
  }

 private:
  mutable std::mutex mutex_;
  std::deque<PlannedMotionPtr> motions_;
  std::uint64_t next_;
};

}  // namespace ompl_planner
