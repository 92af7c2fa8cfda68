/// Rounded paths and their timing: limits hold, rests are rests, corners join smoothly.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "ompl_planner/time_parameterization.h"

namespace ompl_planner {
namespace {

JointVector vec(std::initializer_list<double> values) {
  JointVector v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}

MotionLimits limitsOf(Eigen::Index joints) {
  MotionLimits limits{JointVector::Constant(joints, 1.5), JointVector::Constant(joints, 3.0)};
  limits.velocity[0] = 1.0;
  limits.acceleration[0] = 2.0;
  return limits;
}

JointPath randomPath(unsigned seed, int waypoints, Eigen::Index joints) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-1.5, 1.5);
  JointPath path;
  for (int i = 0; i < waypoints; ++i) {
    path.push_back(JointVector::NullaryExpr(joints, [&] { return value(random); }));
  }
  return path;
}

/// Largest share of the limits that the interpolated trajectory uses.
double worstShare(const TimedTrajectory& trajectory, const MotionLimits& limits) {
  double worst = 0.0;
  for (double t = 0.0; t <= trajectory.duration(); t += 0.001) {
    const PathPoint p = interpolate(trajectory, t);
    worst = std::max(worst, (p.dq.cwiseAbs().array() / limits.velocity.array()).maxCoeff());
    worst = std::max(worst, (p.ddq.cwiseAbs().array() / limits.acceleration.array()).maxCoeff());
  }
  return worst;
}

TEST(BlendedPath, PassesThroughSharpCornersAndRoundsTheOthers) {
  const JointPath waypoints{vec({0, 0}), vec({1, 0}), vec({1, 1}), vec({2, 1})};
  const BlendedPath path(waypoints, {0, 0.2, 0.0, 0});
  ASSERT_EQ(path.rests().size(), 3U);
  EXPECT_NEAR((path.at(path.rests()[1]).q - waypoints[2]).norm(), 0.0, 1e-12);
  const double corner_distance = (path.at(path.waypointParameters()[1]).q - waypoints[1]).norm();
  EXPECT_GT(corner_distance, 0.01);
  EXPECT_LT(corner_distance, 0.2);
}

TEST(BlendedPath, DerivativesMatchFiniteDifferencesAndAreContinuous) {
  const BlendedPath path(randomPath(3, 6, 4), std::vector<double>(6, 0.3));
  const double h = 1e-5;
  for (double s = h; s < path.length() - h; s += path.length() / 997.0) {
    const PathPoint p = path.at(s);
    EXPECT_LT(((path.at(s + h).q - path.at(s - h).q) / (2 * h) - p.dq).norm(), 1e-4) << s;
    EXPECT_LT((path.at(s + h).dq - p.dq).norm(), 1e-2) << s;   // no jump of the tangent
    EXPECT_LT((path.at(s + h).ddq - p.ddq).norm(), 0.2) << s;  // nor of the curvature
  }
}

TEST(BlendedPath, RefusesWhatIsNoPath) {
  EXPECT_THROW(BlendedPath({vec({0})}, {0}), std::invalid_argument);
  EXPECT_THROW(BlendedPath({vec({0}), vec({0})}, {0, 0}), std::invalid_argument);
  EXPECT_THROW(BlendedPath({vec({0}), vec({NAN})}, {0, 0}), std::invalid_argument);
}

TEST(TimeParameterization, StraightLineTakesTheTextbookTime) {
  // 2 rad at 1 rad/s and 2 rad/s^2: 0.5 s up, 1.5 s of cruise, 0.5 s down.
  MotionLimits limits{vec({1.0}), vec({2.0})};
  TimingOptions options;
  options.limit_share = 1.0;
  options.smoothing_time_s = 0.0;
  const auto trajectory = timeOptimalTrajectory(BlendedPath({vec({0}), vec({2})}, {0, 0}), limits, options);
  EXPECT_NEAR(trajectory.duration(), 2.5, 0.03);
}

TEST(TimeParameterization, LimitsHoldBetweenThePointsOnRandomPaths) {
  const MotionLimits limits = limitsOf(7);
  for (unsigned seed = 0; seed < 40; ++seed) {
    const int waypoints = 2 + static_cast<int>(seed % 5);
    const BlendedPath path(randomPath(seed, waypoints, 7), std::vector<double>(waypoints, 0.05 * (seed % 7)));
    const auto trajectory = timeOptimalTrajectory(path, limits, {});
    EXPECT_LE(worstShare(trajectory, limits), 1.0) << "seed " << seed;
  }
}

TEST(TimeParameterization, BeginsAndEndsAtRestAtTheEnds) {
  const JointPath waypoints = randomPath(11, 4, 3);
  const auto trajectory = timeOptimalTrajectory(BlendedPath(waypoints, {0, 0.2, 0.2, 0}), limitsOf(3), {});
  EXPECT_NEAR((trajectory.positions.front() - waypoints.front()).norm(), 0.0, 1e-9);
  EXPECT_NEAR((trajectory.positions.back() - waypoints.back()).norm(), 0.0, 1e-6);
  EXPECT_EQ(trajectory.velocities.front().norm(), 0.0);
  EXPECT_EQ(trajectory.velocities.back().norm(), 0.0);
  EXPECT_EQ(trajectory.times.front(), 0.0);
}

TEST(TimeParameterization, SharpCornersAreKeptExactly) {
  const JointPath waypoints{vec({0, 0}), vec({1, 0}), vec({1, 1})};
  const auto trajectory = timeOptimalTrajectory(BlendedPath(waypoints, {0, 0, 0}), limitsOf(2), {});
  for (double t = 0.0; t <= trajectory.duration(); t += 0.005) {
    const JointVector q = interpolate(trajectory, t).q;
    EXPECT_LT(std::min(std::abs(q[1]), std::abs(q[0] - 1.0)), 1e-4) << t;
  }
}

TEST(TimeParameterization, RefusesLimitsThatAreNone) {
  const BlendedPath path({vec({0}), vec({1})}, {0, 0});
  EXPECT_THROW(timeOptimalTrajectory(path, {vec({0.0}), vec({1.0})}, {}), std::invalid_argument);
  EXPECT_THROW(timeOptimalTrajectory(path, {vec({1.0}), vec({NAN})}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace ompl_planner
