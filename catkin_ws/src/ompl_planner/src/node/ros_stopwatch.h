/// Elapsed ROS time that survives a clock which starts late or jumps.
#pragma once

#include <ros/time.h>

#include <chrono>

namespace ompl_planner {

/// Sums the steps of the ROS clock between looks. A step backwards (a simulation that began anew) or from
/// zero (a simulated clock that has just started) counts as none: waits neither end early nor last forever.
class RosStopwatch {
 public:
  /// Seconds since construction, as far as anybody looked.
  double elapsed() {
    const ros::Time now = ros::Time::now();
    if (now < last_) jumped_back_ = true;
    if (!last_.isZero() && now > last_) elapsed_ += (now - last_).toSec();
    if (now != last_) changed_ = Wall::now();
    last_ = now;
    return elapsed_;
  }
  /// Wall-clock seconds since the ROS clock has last changed, as far as anybody looked.
  double standsStill() const { return std::chrono::duration<double>(Wall::now() - changed_).count(); }
  /// Has the clock gone backwards since construction?
  bool jumpedBack() const { return jumped_back_; }

 private:
  using Wall = std::chrono::steady_clock;
  Wall::time_point changed_{Wall::now()};
  ros::Time last_{ros::Time::now()};
  double elapsed_{0.0};
  bool jumped_back_{false};
};

}  // namespace ompl_planner
