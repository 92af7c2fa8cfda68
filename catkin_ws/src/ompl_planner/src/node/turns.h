/// One at a time, the newest first.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

namespace ompl_planner {

/// Whoever comes next asks the one before to stop, and waits until it has: a new goal replaces the old one,
/// whichever action it came through.
class Turns {
 public:
  class Turn {
   public:
    explicit Turn(Turns& turns) : turns_(turns), number_(++turns.newest_), lock_(turns.mutex_) {}
    /// Is somebody waiting for this turn to end?
    bool replaced() const { return turns_.newest_ != number_; }

   private:
    Turns& turns_;
    std::uint64_t number_;
    std::unique_lock<std::mutex> lock_;
  };

 private:
  std::atomic<std::uint64_t> newest_{0};
  std::mutex mutex_;
};

}  // namespace ompl_planner
