// Tolerances against brute force: whatever joint values keep them, some are found, on chains of one to seven
// joints.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fv_robot_model/ik/pose_target.h"

namespace fv_robot_model::ik {
namespace {

using Eigen::Vector3d;

ChainJoint turning(const Vector3d& axis, const Vector3d& point, double lower, double upper) {
  ChainJoint joint;
  joint.name = "turning";
  joint.axis = axis.normalized();
  joint.point = point;
  joint.lower = lower;
  joint.upper = upper;
  return joint;
}

ChainJoint sliding(const Vector3d& axis, double lower, double upper) {
  ChainJoint joint = turning(axis, Vector3d::Zero(), lower, upper);
  joint.prismatic = true;
  return joint;
}

Eigen::Isometry3d tipAt(const Vector3d& p) {
  Eigen::Isometry3d T(Eigen::AngleAxisd(0.4, Vector3d(0.3, 1.0, -0.2).normalized()));
  T.translation() = p;
  return T;
}

struct Machine {
  std::string label;
  SerialChain chain;
};

std::vector<Machine> machines() {
  const Vector3d X = Vector3d::UnitX(), Y = Vector3d::UnitY(), Z = Vector3d::UnitZ(), O = Vector3d::Zero();
  const auto scara = [&](double first_range) {
    return SerialChain({turning(Z, O, -first_range, first_range), turning(Z, {0.32, 0, 0}, -2.4, 2.4),
                        sliding(-Z, 0.0, 0.25), turning(Z, {0.59, 0, 0}, -3.1, 3.1)},
                       tipAt({0.67, 0, 0.1}));
  };
  return {
      {"Turntable", SerialChain({turning(Z, O, -M_PI, M_PI)}, tipAt({0.5, 0, 0.2}))},
      {"Rail", SerialChain({sliding(X, -0.5, 1.0)}, tipAt({0, 0, 0.2}))},
      {"PanTilt", SerialChain({turning(Z, O, -2.8, 2.8), turning(Y, {0.03, 0, 0.1}, -1.2, 0.9)},
                              tipAt({0.12, 0.02, 0.15}))},
      {"Gantry", SerialChain({sliding(X, -1, 1), sliding(Y, -0.5, 0.5), sliding(Z, 0, 0.8)}, tipAt(O))},
      {"PlanarArm", SerialChain({turning(Z, O, -2.9, 2.9), turning(Z, {0.4, 0, 0}, -2.9, 2.9),
                                 turning(Z, {0.7, 0, 0}, -2.9, 2.9)},
                                tipAt({0.9, 0, 0}))},
      {"Scara", scara(2.3)},
      {"ScaraAllTheWayRound", scara(M_PI)},
      {"ScaraTwiceRound", scara(6.28)},
      {"GantryWithWrist", SerialChain({sliding(X, -1, 1), sliding(Y, -0.5, 0.5), sliding(Z, 0, 0.8),
                                       turning(Z, O, -M_PI, M_PI), turning(Y, {0, 0, -0.1}, -1.5, 1.5)},
                                      tipAt({0.05, 0, -0.25}))},
      {"FiveJoints",
       SerialChain({turning(Z, O, -2.9, 2.9), turning(Y, {0.1, 0, 0.3}, -1.6, 1.6),
                    turning(X, {0.3, 0, 0.4}, -2.0, 2.0), turning(Y, {0.5, 0.1, 0.4}, -2.0, 2.0),
                    turning(Z, {0.6, 0.1, 0.3}, -2.9, 2.9)},
                   tipAt({0.7, 0.05, 0.2}))},
      {"SlideAndFive",
       SerialChain({sliding(Z, 0, 0.3), turning(Z, O, -2, 2), turning(Y, {0.3, 0, 0.1}, -2, 2),
                    turning(X, {0.6, 0, 0.1}, -2, 2), turning({0, 1, 0.3}, {0.8, 0, 0.1}, -2, 2),
                    turning({0.3, 0, 1}, {0.9, 0.1, 0.1}, -2, 2)},
                   tipAt({1.0, 0, 0.1}))},
  };
}

using Random = std::mt19937;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Vector3d inBall(Random& random, double radius) {
  Vector3d p;
  do {
    for (double& value : p) value = uniform(random, -1, 1);
  } while (p.norm() > 1.0);
  return radius * p;
}

Eigen::VectorXd randomState(Random& random, const SerialChain& chain) {
  Eigen::VectorXd q(chain.dof());
  for (int k = 0; k < chain.dof(); ++k) q[k] = uniform(random, chain.joint(k).lower, chain.joint(k).upper);
  return q;
}

/// The larger of both misses, in tolerances. Written apart from missOf().
double worstMiss(const PoseTarget& target, const SerialChain& chain, const Eigen::VectorXd& q) {
  const Eigen::Isometry3d T = chain.forward(q.data()) * target.T_tip_tool;
  const Eigen::Matrix3d R = T.linear().transpose() * target.T_base_tool.linear();
  const double cosine =
      target.free_roll ? target.roll_axis.dot(R * target.roll_axis) : 0.5 * (R.trace() - 1.0);
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  return std::max((T.translation() - target.T_base_tool.translation()).norm() / target.position_tolerance_m,
                  angle / target.angle_tolerance_rad);
}

/// Dense sampling, then random steps that shrink: slow, and without a derivative.
double bestByBruteForce(const PoseTarget& target, const SerialChain& chain, Random& random) {
  constexpr int kSamples = 3000, kRefined = 6, kSteps = 1500;
  std::vector<std::pair<double, Eigen::VectorXd>> states;
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::VectorXd q = randomState(random, chain);
    states.emplace_back(worstMiss(target, chain, q), q);
  }
  std::partial_sort(states.begin(), states.begin() + kRefined, states.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  double best = states.front().first;
  for (int s = 0; s < kRefined; ++s) {
    auto [miss, q] = states[static_cast<size_t>(s)];
    for (int i = 0; i < kSteps; ++i) {
      const double reach = 0.3 * std::pow(1e-5, static_cast<double>(i) / kSteps);
      Eigen::VectorXd trial = q;
      for (int k = 0; k < chain.dof(); ++k) {
        trial[k] =
            std::clamp(q[k] + uniform(random, -reach, reach), chain.joint(k).lower, chain.joint(k).upper);
      }
      const double next = worstMiss(target, chain, trial);
      if (next < miss) {
        miss = next;
        q = trial;
      }
    }
    best = std::min(best, miss);
  }
  return best;
}

/// A target that some state reaches within `share` of its tolerances.
PoseTarget targetNear(Random& random, const SerialChain& chain, double share) {
  PoseTarget target;
  target.free_roll = uniform(random, 0, 1) < 0.5;
  target.roll_axis = inBall(random, 1.0).normalized();
  target.position_tolerance_m = std::pow(10.0, uniform(random, -4, -1));
  target.angle_tolerance_rad = std::pow(10.0, uniform(random, -4, 0));
  target.T_tip_tool.translation() = inBall(random, 0.2);
  target.T_tip_tool.rotate(Eigen::AngleAxisd(uniform(random, -3, 3), inBall(random, 1.0).normalized()));
  target.T_base_tool = chain.forward(randomState(random, chain).data()) * target.T_tip_tool;
  if (target.free_roll)
    target.T_base_tool.rotate(Eigen::AngleAxisd(uniform(random, -3, 3), target.roll_axis));
  target.T_base_tool.pretranslate(inBall(random, share * target.position_tolerance_m));
  const Vector3d tilt = inBall(random, share * target.angle_tolerance_rad);
  target.T_base_tool.rotate(Eigen::AngleAxisd(tilt.norm(), tilt.normalized()));
  return target;
}

class Tolerances : public testing::TestWithParam<Machine> {
 protected:
  IkSolutions solve(const PoseTarget& target, int count = 40) const {
    IkSolutions out(GetParam().chain.dof());
    TolerantIk(GetParam().chain, 150).solve(target, nullptr, 0, count, out);
    return out;
  }
};

TEST_P(Tolerances, WhatAnyStateReachesIsFoundAndIsReached) {
  const SerialChain& chain = GetParam().chain;
  Random random(1);
  int missed = 0;
  constexpr int kTargets = 1000;
  for (int i = 0; i < kTargets; ++i) {
    const PoseTarget target = targetNear(random, chain, 0.95);
    const IkSolutions found = solve(target);
    missed += found.empty() ? 1 : 0;
    for (int row = 0; row < found.size(); ++row) {
      const Eigen::Map<const Eigen::VectorXd> q(found.row(row), chain.dof());
      EXPECT_LE(worstMiss(target, chain, q),
                1.0 + 0.02);  // reaches() allows 1e-6 more than tolerances of 1e-4
      EXPECT_TRUE(chain.withinLimits(found.row(row), 1e-9));
      EXPECT_TRUE(reaches(target, chain.forward(found.row(row))));
    }
  }
  EXPECT_LE(missed, kTargets / 200);
}

TEST_P(Tolerances, BruteForceFindsNothingThatDescentMisses) {
  const SerialChain& chain = GetParam().chain;
  Random random(2);
  int unreachable = 0;
  for (int i = 0; i < 60; ++i) {
    PoseTarget target = targetNear(random, chain, 2.0);
    target.position_tolerance_m = std::max(target.position_tolerance_m, 0.003);  // as far as brute force sees
    target.angle_tolerance_rad = std::max(target.angle_tolerance_rad, 0.01);
    if (i % 6 == 0) target.T_base_tool.translation() *= 1.7;  // arms of six joints reach all that is near
    const bool found = !solve(target).empty();
    const double best = bestByBruteForce(target, chain, random);
    EXPECT_TRUE(found || best > 0.999)
        << "target " << i << ": brute force misses by " << best << " tolerances";
    unreachable += found ? 0 : 1;
  }
  EXPECT_GT(unreachable, 0) << "else this test tells nothing";
  EXPECT_LT(unreachable, 60);
}

TEST_P(Tolerances, APoseRoundedToThreeDecimalsIsReached) {
  const SerialChain& chain = GetParam().chain;
  const auto rounded = [](double value) { return std::round(1e3 * value) / 1e3; };
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    PoseTarget target;
    target.position_tolerance_m = 0.002;
    target.angle_tolerance_rad = 0.005;
    target.T_base_tool = chain.forward(randomState(random, chain).data());
    target.T_base_tool.translation() = target.T_base_tool.translation().unaryExpr(rounded);
    Eigen::Quaterniond turn(target.T_base_tool.linear());
    turn.coeffs() = turn.coeffs().unaryExpr(rounded);
    target.T_base_tool.linear() = turn.normalized().toRotationMatrix();
    EXPECT_FALSE(solve(target).empty()) << i;
  }
}

TEST_P(Tolerances, TheSolverOfAGroupKeepsTheTolerancesOfItsOptions) {
  const SerialChain& chain = GetParam().chain;
  IkOptions options;
  options.position_tolerance_m = 0.01;
  options.angle_tolerance_rad = 0.02;
  const auto solver = makeIkSolver(chain, options);
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    Eigen::Isometry3d T = chain.forward(randomState(random, chain).data());
    T.pretranslate(inBall(random, 0.009));
    EXPECT_EQ(solver->solve({T}).offsets.back() > 0, true) << solver->name();
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, Tolerances, testing::ValuesIn(machines()),
                         [](const auto& info) { return info.param.label; });

TEST(TolerantIk, RefusesWhatMakesNoSense) {
  EXPECT_THROW(TolerantIk(machines().front().chain, 0), std::invalid_argument);
}

}  // namespace
}  // namespace fv_robot_model::ik
