#pragma once

#include <vector>

#include "ompl_planner/blended_path.h"

namespace ompl_planner {

/// Symmetric limits, one per joint of the group.
struct MotionLimits {
  JointVector velocity;      ///< [rad/s], positive
  JointVector acceleration;  ///< [rad/s^2], positive
};

/// How a path becomes a motion.
struct TimingOptions {
  double sample_period_s{0.01};   ///< Largest spacing of the trajectory's points [s].
  double smoothing_time_s{0.02};  ///< Width of the acceleration ramps [s]; 0: bang-bang accelerations.
                                  ///< Motions below 120 samples scale both with their duration.
  double grid_step{0.01};         ///< Grid of the reachability analysis [rad of path parameter].
  double limit_share{0.975};      ///< Share of the limits that is used, in (0, 1].
};

/// A motion that starts and ends at rest.
struct TimedTrajectory {
  std::vector<double> times;  ///< [s], from 0, ascending
  JointPath positions;        ///< [rad]
  JointPath velocities;       ///< [rad/s]
  JointPath accelerations;    ///< [rad/s^2]
  double duration() const { return times.empty() ? 0.0 : times.back(); }
};

/// Position of a trajectory between its points, as joint trajectory controllers see it: quintic splines
/// through positions, velocities and accelerations. Clamped to the trajectory's duration.
PathPoint interpolate(const TimedTrajectory& trajectory, double time_s);

/// The fastest motion along a path within the limits, with short acceleration ramps.
///
/// Time-optimal path parameterisation by reachability analysis (Pham and Pham, "A New Approach to
/// Time-Optimal Path Parameterization Based on Reachability Analysis", IEEE T-RO 2018): the squared path
/// speed x is bounded backwards by what can still brake, then pushed forwards as far as the bounds allow.
/// Then each stretch between two rests is averaged over a window of smoothing_time_s: an average of values
/// within limits is within limits, so velocity and acceleration bounds hold, jerk becomes bounded, and the
/// duration grows by one window per stretch, at most a sixtieth of it where the window is two samples.
///
/// @throws std::invalid_argument unless all limits and options are positive and finite.
TimedTrajectory timeOptimalTrajectory(const BlendedPath& path, const MotionLimits& limits,
                                      const TimingOptions& options);

}  // namespace ompl_planner
