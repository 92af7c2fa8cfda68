#include "ompl_planner/time_parameterization.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace ompl_planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Linear constraints low <= a u + b x <= high on the path acceleration u and the squared path speed x.
struct Constraint {
  double a, b, bound;  // |a u + b x| <= bound
};

struct Interval {
  double low, high;
  bool empty() const { return low > high; }
};

/// One stretch of a path between two rests, discretised.
struct Stretch {
  std::vector<double> s;
  std::vector<std::vector<Constraint>> constraints;  // of the intervals, one fewer than s
  std::vector<double> max_x;                         // velocity bound on x at each grid point
};

/// Path accelerations that all constraints allow at x.
Interval feasibleAccelerations(const std::vector<Constraint>& constraints, double x) {
  Interval range{-kInfinity, kInfinity};
  for (const Constraint& c : constraints) {
    const double rest = c.b * x;
    if (std::abs(c.a) < 1e-12) {
      if (std::abs(rest) > c.bound * (1.0 + 1e-9)) return {1.0, -1.0};
      continue;
    }
    const double first = (-c.bound - rest) / c.a;
    const double second = (c.bound - rest) / c.a;
    range.low = std::max(range.low, std::min(first, second));
    range.high = std::min(range.high, std::max(first, second));
  }
  return range;
}

/// Can the motion leave speed x so that the next squared speed lies in [0, next_max]?
bool controllable(const std::vector<Constraint>& constraints, double x, double next_max, double step) {
  Interval range = feasibleAccelerations(constraints, x);
  range.low = std::max(range.low, -x / (2.0 * step));
  range.high = std::min(range.high, (next_max - x) / (2.0 * step));
  return !range.empty();
}

/// The allowed (u, x) form a convex set that holds (0, 0): the allowed x are an interval from 0, found by
/// bisection.
double largestControllable(const std::vector<Constraint>& constraints, double max_x, double next_max,
                           double step) {
  if (controllable(constraints, max_x, next_max, step)) return max_x;
  double good = 0.0;
  double bad = max_x;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (good + bad);
    (controllable(constraints, middle, next_max, step) ? good : bad) = middle;
  }
  return good;
}

double velocityBound(const JointVector& dq, const JointVector& velocity) {
  double max_x = 1e6;
  for (Eigen::Index j = 0; j < dq.size(); ++j) {
    if (std::abs(dq[j]) > 1e-12) max_x = std::min(max_x, std::pow(velocity[j] / dq[j], 2));
  }
  return max_x;
}

/// Acceleration constraints of an interval, at its begin and (in terms of the begin's u and x) at its end.
std::vector<Constraint> intervalConstraints(const PathPoint& begin, const PathPoint& end, double step,
                                            const JointVector& acceleration) {
  std::vector<Constraint> constraints;
  constraints.reserve(static_cast<std::size_t>(2 * acceleration.size()));
  for (Eigen::Index j = 0; j < acceleration.size(); ++j) {
    constraints.push_back({begin.dq[j], begin.ddq[j], acceleration[j]});
    constraints.push_back({end.dq[j] + 2.0 * step * end.ddq[j], end.ddq[j], acceleration[j]});
  }
  return constraints;
}

/// @param grid Of the whole path; its parameters from `from` to `to` are used.
Stretch discretise(const BlendedPath& path, const std::vector<double>& grid, double from, double to,
                   const MotionLimits& limits) {
  // The ends of a stretch are taken just inside, so that a sharp corner shows the side that belongs to it.
  const double inset = 1e-9 * (to - from);
  Stretch stretch;
  stretch.s.push_back(from);
  for (const double s : grid) {
    if (s > from + inset && s < to - inset) stretch.s.push_back(s);
  }
  stretch.s.push_back(to);
  std::vector<PathPoint> points;
  for (const double s : stretch.s) {
    points.push_back(path.at(std::min(std::max(s, from + inset), to - inset)));
    stretch.max_x.push_back(velocityBound(points.back().dq, limits.velocity));
  }
  for (std::size_t i = 0; i + 1 < stretch.s.size(); ++i) {
    const double step = stretch.s[i + 1] - stretch.s[i];
    stretch.constraints.push_back(intervalConstraints(points[i], points[i + 1], step, limits.acceleration));
  }
  return stretch;
}

/// Squared path speed at each grid point of the time-optimal motion from rest to rest.
std::vector<double> optimalSquaredSpeed(const Stretch& stretch) {
  const std::size_t n = stretch.s.size();
  std::vector<double> bound(n, 0.0);
  for (std::size_t i = n - 1; i-- > 0;) {
    const double step = stretch.s[i + 1] - stretch.s[i];
    bound[i] = largestControllable(stretch.constraints[i], stretch.max_x[i], bound[i + 1], step);
  }
  std::vector<double> x(n, 0.0);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double step = stretch.s[i + 1] - stretch.s[i];
    const Interval range = feasibleAccelerations(stretch.constraints[i], x[i]);
    x[i + 1] = std::min(bound[i + 1], std::max(0.0, x[i] + 2.0 * step * range.high));
  }
  return x;
}

/// Path parameter as a function of time, piecewise of constant path acceleration.
class Profile {
 public:
  explicit Profile(const Stretch& stretch) : s_(stretch.s), x_(optimalSquaredSpeed(stretch)) {
    for (std::size_t i = 0; i + 1 < s_.size(); ++i) {
      const double speed_sum = std::sqrt(x_[i]) + std::sqrt(x_[i + 1]);
      if (speed_sum < 1e-12)
        throw std::runtime_error("time parameterisation: the path cannot be left at rest");
      times_.push_back(times_.back() + 2.0 * (s_[i + 1] - s_[i]) / speed_sum);
    }
  }
  double duration() const { return times_.back(); }

  double parameterAt(double t) const {
    const auto next = std::upper_bound(times_.begin() + 1, times_.end() - 1, t);
    const auto i = static_cast<std::size_t>(next - times_.begin()) - 1;
    const double tau = std::min(std::max(t - times_[i], 0.0), times_[i + 1] - times_[i]);
    const double u = (x_[i + 1] - x_[i]) / (2.0 * (s_[i + 1] - s_[i]));
    return s_[i] + std::sqrt(x_[i]) * tau + 0.5 * u * tau * tau;
  }

 private:
  std::vector<double> s_;
  std::vector<double> x_;
  std::vector<double> times_{0.0};
};

/// Positions of a stretch at `count` even fine steps, held still before and after it.
class FinePositions {
 public:
  FinePositions(const BlendedPath& path, const Profile& profile, std::ptrdiff_t count) : count_(count) {
    for (std::ptrdiff_t i = 0; i <= count; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(count);
      q_.push_back(path.at(profile.parameterAt(share * profile.duration())).q);
    }
  }
  const JointVector& at(std::ptrdiff_t i) const {
    return q_[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, count_))];
  }

 private:
  std::ptrdiff_t count_;
  JointPath q_;
};

void appendPoint(TimedTrajectory& out, double time, const JointVector& q, const JointVector& dq,
                 const JointVector& ddq) {
  out.times.push_back(time);
  out.positions.push_back(q);
  out.velocities.push_back(dq);
  out.accelerations.push_back(ddq);
}

constexpr int kFine = 10;         // fine steps per sample: the window average is a sum over them
constexpr double kSamples = 120;  // of a stretch, at least: short motions get short samples and short ramps

/// How a stretch is sampled: `samples` of kFine equal fine steps; the window average spans `window` of those.
struct Sampling {
  std::ptrdiff_t window;
  std::ptrdiff_t samples;
  double step;  ///< Of time, fine [s]; motion and window together fill the samples exactly.
};

Sampling samplingOf(double duration, const TimingOptions& options) {
  const double period = std::min(options.sample_period_s, duration / kSamples);
  const double windows = kFine * options.smoothing_time_s / options.sample_period_s;
  // two steps at least: the central differences of a piecewise constant acceleration need it
  const auto window = std::max<std::ptrdiff_t>(2, static_cast<std::ptrdiff_t>(std::lround(windows)));
  const double fine = kFine * duration / period + static_cast<double>(window);
  const auto samples = static_cast<std::ptrdiff_t>(std::ceil(fine / kFine));
  return {window, samples, duration / static_cast<double>(samples * kFine - window)};
}

/// Appends one stretch, from rest to rest, averaged over a window of time.
void appendStretch(const BlendedPath& path, const Profile& profile, const TimingOptions& options,
                   TimedTrajectory& out) {
  const auto [window, samples, step] = samplingOf(profile.duration(), options);
  const FinePositions fine(path, profile, samples * kFine - window);
  const double begin = out.duration();
  for (std::ptrdiff_t k = out.times.empty() ? 0 : 1; k <= samples; ++k) {
    const std::ptrdiff_t end = k * kFine;
    // q averages fine[end - window .. end]; its derivatives are differences of what enters and what leaves
    JointVector sum = 0.5 * (fine.at(end) + fine.at(end - window));
    for (std::ptrdiff_t i = end - window + 1; i < end; ++i) sum += fine.at(i);
    const double width = step * static_cast<double>(window);
    const JointVector velocity = (fine.at(end) - fine.at(end - window)) / width;
    const JointVector acceleration =
        (fine.at(end + 1) - fine.at(end - 1) - fine.at(end - window + 1) + fine.at(end - window - 1)) /
        (2.0 * step * width);
    appendPoint(out, begin + static_cast<double>(end) * step, sum / static_cast<double>(window), velocity,
                acceleration);
  }
  out.velocities.back().setZero();
  out.accelerations.back().setZero();
}

void checkPositive(const JointVector& values, const char* what, Eigen::Index size) {
  if (values.size() != size || !values.allFinite() || values.minCoeff() <= 0.0) {
    throw std::invalid_argument(std::string("time parameterisation needs positive, finite ") + what +
                                " limits, one per joint");
  }
}

void checkInput(const BlendedPath& path, const MotionLimits& limits, const TimingOptions& options) {
  const Eigen::Index joints = path.at(0.0).q.size();
  checkPositive(limits.velocity, "velocity", joints);
  checkPositive(limits.acceleration, "acceleration", joints);
  if (!(options.sample_period_s > 0.0) || !(options.grid_step > 0.0) || !(options.limit_share > 0.0) ||
      options.limit_share > 1.0 || !(options.smoothing_time_s >= 0.0)) {
    throw std::invalid_argument("time parameterisation: options out of range");
  }
}

}  // namespace

PathPoint interpolate(const TimedTrajectory& trajectory, double time_s) {
  const std::size_t last = trajectory.times.size() - 1;
  const double t = std::min(std::max(time_s, 0.0), trajectory.duration());
  if (last == 0) return {trajectory.positions[0], trajectory.velocities[0], trajectory.accelerations[0]};
  const auto next = std::upper_bound(trajectory.times.begin() + 1, trajectory.times.end() - 1, t);
  const auto i = static_cast<std::size_t>(next - trajectory.times.begin()) - 1;
  const double h = trajectory.times[i + 1] - trajectory.times[i];
  const double tau = t - trajectory.times[i];
  const JointVector &q0 = trajectory.positions[i], &q1 = trajectory.positions[i + 1];
  const JointVector &v0 = trajectory.velocities[i], &v1 = trajectory.velocities[i + 1];
  const JointVector &a0 = trajectory.accelerations[i], &a1 = trajectory.accelerations[i + 1];
  // the quintic that meets both ends: remainders of position, velocity and acceleration after the cubic part
  const JointVector dp = q1 - q0 - v0 * h - 0.5 * a0 * h * h;
  const JointVector dv = (v1 - v0 - a0 * h) * h;
  const JointVector da = (a1 - a0) * h * h;
  const JointVector c3 = (10.0 * dp - 4.0 * dv + 0.5 * da) / std::pow(h, 3);
  const JointVector c4 = (-15.0 * dp + 7.0 * dv - da) / std::pow(h, 4);
  const JointVector c5 = (6.0 * dp - 3.0 * dv + 0.5 * da) / std::pow(h, 5);
  const double t2 = tau * tau;
  const double t3 = t2 * tau;
  return {q0 + v0 * tau + 0.5 * a0 * t2 + c3 * t3 + c4 * t2 * t2 + c5 * t2 * t3,
          v0 + a0 * tau + 3.0 * c3 * t2 + 4.0 * c4 * t3 + 5.0 * c5 * t2 * t2,
          a0 + 6.0 * c3 * tau + 12.0 * c4 * t2 + 20.0 * c5 * t3};
}

TimedTrajectory timeOptimalTrajectory(const BlendedPath& path, const MotionLimits& limits,
                                      const TimingOptions& options) {
  checkInput(path, limits, options);
  const MotionLimits used{options.limit_share * limits.velocity, options.limit_share * limits.acceleration};
  TimedTrajectory trajectory;
  const auto& rests = path.rests();
  const auto grid = path.grid(options.grid_step);
  for (std::size_t i = 0; i + 1 < rests.size(); ++i) {
    const Profile profile(discretise(path, grid, rests[i], rests[i + 1], used));
    appendStretch(path, profile, options, trajectory);
  }
  return trajectory;
}

}  // namespace ompl_planner
