/// Searches among the states of shorter paths: which they are, and that the longer way round is left out.
#include <gtest/gtest.h>

#include <cmath>

#include "path_search.h"

namespace ompl_planner {
namespace {

/// From (-1, 0) to (1, 0) about a wall on x = 0 that is open from y = 0.5 to 1 and below y = -2.
SearchProblem wallWithTwoWaysRound() {
  SearchProblem problem;
  problem.lower = JointVector::Constant(2, -4.0);
  problem.upper = JointVector::Constant(2, 4.0);
  problem.start = JointVector(Eigen::Vector2d(-1.0, 0.0));
  problem.goals = {JointVector(Eigen::Vector2d(1.0, 0.0))};
  problem.valid = [](const JointVector& q) {
    return std::abs(q.x()) > 0.1 || (q.y() > 0.5 && q.y() < 1.0) || q.y() < -2.0;
  };
  problem.edge_valid = [valid = problem.valid](const JointVector& a, const JointVector& b) {
    for (double s = 0.0; s < 1.0; s += 0.01) {
      if (!valid(a + s * (b - a))) return false;
    }
    return true;
  };
  return problem;
}

bool passesBelow(const JointPath& path) {
  for (const JointVector& q : path) {
    if (q.y() < -2.0) return true;
  }
  return false;
}

TEST(ShorterThan, AllowsTheStatesOfAnEllipseAboutStartAndGoal) {
  const SearchProblem problem = shorterThan(wallWithTwoWaysRound(), 2.6);
  EXPECT_TRUE(problem.valid(Eigen::Vector2d(0.0, 0.8)));
  EXPECT_FALSE(problem.valid(Eigen::Vector2d(0.0, 0.9))) << "2 sqrt(1 + 0.81) > 2.6";
  EXPECT_TRUE(problem.valid(Eigen::Vector2d(-1.2, 0.0)));
  EXPECT_FALSE(problem.valid(Eigen::Vector2d(-1.4, 0.0)));
  EXPECT_FALSE(problem.valid(Eigen::Vector2d(0.0, 0.3))) << "blocked as before";
}

TEST(ShorterThan, LeavesOutTheLongWayRound) {
  const auto never = [] { return false; };
  bool below = false;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const auto any = findPath(wallWithTwoWaysRound(), "RRTConnect", seed, never);
    ASSERT_TRUE(any.has_value());
    below = below || passesBelow(*any);
    const auto shorter = findPath(shorterThan(wallWithTwoWaysRound(), 4.0), "RRTConnect", seed, never);
    ASSERT_TRUE(shorter.has_value());
    EXPECT_FALSE(passesBelow(*shorter)) << seed;
  }
  EXPECT_TRUE(below) << "else this test tells nothing";
}

TEST(FindPath, GivesUpAfterItsRounds) {
  SearchProblem problem = shorterThan(wallWithTwoWaysRound(), 2.1);  // no way round is that short
  problem.search_rounds = 200;
  EXPECT_FALSE(findPath(problem, "RRTConnect", 1, [] { return false; }).has_value());
}

}  // namespace
}  // namespace ompl_planner
