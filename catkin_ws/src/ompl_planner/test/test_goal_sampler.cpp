/// Equal angles: the nearest one within the limits, against all copies one by one.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "goal_sampler.h"

namespace ompl_planner {
namespace {

constexpr double kTurn = 2.0 * M_PI;

TEST(NearestTurn, IsTheNearestOfAllCopiesWithinTheLimits) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> value(-20.0, 20.0);
  int moved = 0;
  for (int i = 0; i < 20000; ++i) {
    fv_robot_model::JointLimits limits;
    limits.lower = value(random);
    limits.upper = limits.lower + std::abs(value(random));
    limits.bounded = i % 3 != 0;
    const double angle = value(random), near = value(random);
    double best = angle, least = 1e9;
    for (int k = -20; k <= 20; ++k) {
      const double copy = angle + k * kTurn;
      if (limits.bounded && (copy < limits.lower || copy > limits.upper)) continue;
      if (std::abs(copy - near) < least) {
        best = copy;
        least = std::abs(copy - near);
      }
    }
    EXPECT_NEAR(nearestTurn(angle, near, limits), best, 1e-9);
    moved += best == angle ? 0 : 1;
  }
  EXPECT_GT(moved, 1000);
}

TEST(NearestTurn, LeavesAnglesThatAreNearestToTheBit) {
  fv_robot_model::JointLimits limits;
  limits.lower = -3.05;
  limits.upper = 3.05;
  EXPECT_EQ(nearestTurn(-3.0, 3.0, limits), -3.0);
  EXPECT_EQ(nearestTurn(0.1, 0.2, limits), 0.1);
}

/// A joint, and one that mimics it: of a type and with a multiplier.
fv_robot_model::RobotModel withMimic(const std::string& type, const std::string& multiplier) {
  return fv_robot_model::RobotModel::fromXml(
      "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>"
      "<joint name='j' type='continuous'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/></joint>"
      "<joint name='m' type='" +
          type +
          "'><parent link='b'/><child link='c'/><axis xyz='0 0 1'/>"
          "<limit lower='-9' upper='9' effort='1' velocity='1'/><mimic joint='j' multiplier='" +
          multiplier + "'/></joint></robot>",
      "");
}

TEST(WholeTurns, CountOnlyWhereTheyLeaveTheRobotAsItIs) {
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(1, 2.0 * kTurn + 0.3);
  EXPECT_NEAR(wholeTurns(withMimic("continuous", "-2"), q)[0], 2.0 * kTurn, 1e-12);
  EXPECT_EQ(wholeTurns(withMimic("continuous", "0.5"), q)[0], 0.0);
  EXPECT_EQ(wholeTurns(withMimic("prismatic", "1"), q)[0], 0.0);
}

}  // namespace
}  // namespace ompl_planner
