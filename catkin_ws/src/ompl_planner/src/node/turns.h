/// One at a time, the newest first.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <utility>

namespace ompl_planner {

/// Whoever comes next asks the one before to stop, and waits until it has: a new goal replaces the old one,
/// whichever action it came through.
class Turns {
 public:
  class Turn {
   public:
    /// Waits for the turn before to end, but no longer than until this one is to stop itself.
    Turn(Turns& turns, std::function<bool()> cancelled)
        : turns_(turns), cancelled_(std::move(cancelled)), number_(++turns.newest_) {
      std::unique_lock<std::mutex> lock(turns_.mutex_);
      while (turns_.taken_ && !stopped()) turns_.freed_.wait_for(lock, std::chrono::milliseconds(5));
      mine_ = !turns_.taken_;
      if (mine_) turns_.taken_ = true;
    }
    ~Turn() {
      if (!mine_) return;
      {
        const std::lock_guard<std::mutex> lock(turns_.mutex_);
        turns_.taken_ = false;
      }
      turns_.freed_.notify_all();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

    /// Cancelled, or somebody is waiting for this turn to end; once true, it stays so. Who did not get the
    /// turn is stopped.
    bool stopped() const { return cancelled_() || turns_.newest_ != number_; }

   private:
    Turns& turns_;
    std::function<bool()> cancelled_;
    std::uint64_t number_;
    bool mine_{false};
  };

 private:
  std::atomic<std::uint64_t> newest_{0};
  std::mutex mutex_;
  std::condition_variable freed_;
  bool taken_{false};
};

}  // namespace ompl_planner
