/// Elapsed ROS time that survives a clock which starts late or jumps.
#pragma once

#include <ros/time.h>

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
    last_ = now;
    return elapsed_;
  }
  /// Has the clock gone backwards since construction?
  bool jumpedBack() const { return jumped_back_; }

 private:
  ros::Time last_{ros::Time::now()};
  double elapsed_{0.0};
  bool jumped_back_{false};
};

}  // namespace ompl_planner
