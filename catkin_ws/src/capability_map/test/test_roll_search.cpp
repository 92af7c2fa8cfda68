// Rolls: what the bound leaves out has no solution, and no window is missed that fine steps find.

#include <gtest/gtest.h>

#include <random>

#include "roll_search.h"

namespace capability_map {
namespace {

namespace ik = fv_robot_model::ik;
using Eigen::Vector3d;

ik::ChainJoint joint(const Vector3d& axis, const Vector3d& point, double lower, double upper) {
  return {"j", axis.normalized(), point, lower, upper, false};
}

/// A camera beside the last axis, looking across it.
Eigen::Isometry3d camera(const Vector3d& at) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = at;
  T.linear() = Eigen::AngleAxisd(0.7, Vector3d(1.0, -2.0, 0.5).normalized()).toRotationMatrix();
  return T;
}

ik::SerialChain sphericalShoulder(double share_of_limits) {
  const double k = share_of_limits;
  return ik::SerialChain(
      {joint({0, 1, 0}, {0, 0, 0}, -3.1 * k, 3.1 * k), joint({1, 0, 0}, {0, 0, 0}, -3.1 * k, 0.0),
       joint({0, 0, 1}, {0, 0, 0}, -3.1 * k, 3.1 * k),
       joint({0, 1, 0}, {0.022, 0.018, -0.182}, -2.5 * k, 0.07),
       joint({0, 0, 1}, {0, 0, -0.29}, -3.1 * k, 3.1 * k),
       joint({0, 1, 0}, {0, 0, -0.346}, -1.64 * k, 1.01 * k)},
      camera({0.03, 0.01, -0.45}));
}

ik::SerialChain sphericalWrist() {  // two axes meet at the shoulder
  const Vector3d W(0.3, 0, 0.6);
  return ik::SerialChain({joint({0, 0, 1}, {0, 0, 0}, -3.0, 3.0), joint({0, 1, 0}, {0, 0, 0.3}, -2.0, 2.0),
                          joint({0, 1, 0}, {0, 0, 0.6}, -2.5, 2.5), joint({1, 0, 0}, W, -3.1, 3.1),
                          joint({0, 1, 0}, W, -1.0, 2.0), joint({1, 0, 0}, W, -2.2, 2.2)},
                         camera({0.4, 0.05, 0.6}));
}

std::vector<double> randomConfiguration(const ik::SerialChain& chain, std::mt19937& random) {
  std::vector<double> q;
  for (const ik::ChainJoint& j : chain.joints())
    q.push_back(std::uniform_real_distribution<double>(j.lower, j.upper)(random));
  return q;
}

TEST(ElbowBound, LeavesEveryRollThatTheArmCanHold) {
  std::mt19937 random(1);
  for (const ik::SerialChain& chain : {sphericalShoulder(1.0), sphericalShoulder(0.4), sphericalWrist()}) {
    const ElbowBound bound(chain);
    int refused = 0;
    for (int i = 0; i < 5000; ++i) {
      const Eigen::Isometry3d T = chain.forward(randomConfiguration(chain, random).data());
      const double roll = std::uniform_real_distribution<double>(-4.0, 4.0)(random);
      const Eigen::Isometry3d unrolled = T * Eigen::AngleAxisd(-roll, Vector3d::UnitZ());
      const ElbowBound::Rolls rolls = bound.rolls(unrolled);
      EXPECT_FALSE(rolls.none());
      EXPECT_TRUE(rolls.admits(std::cos(roll), std::sin(roll)));
      refused += rolls.admits(std::cos(roll + 3.0), std::sin(roll + 3.0)) ? 0 : 1;
    }
    EXPECT_GT(refused, 500);  // and it is not a bound for the sake of one
    Eigen::Isometry3d far = chain.zeroPose();
    far.translation() += Vector3d(0.0, 5.0, 0.0);
    EXPECT_TRUE(bound.rolls(far).none());
  }
}

bool held(RollSearch& search, const Eigen::Isometry3d& T, const ik::SerialChain& chain) {
  bool found = false;
  const auto any = [](const Eigen::Isometry3d&, size_t) { return true; };
  search.search(T, any, [&](RollSearch::Solutions& solutions) {
    for (int i = 0; i < solutions.size(); ++i) {
      const Eigen::Isometry3d actual = chain.forward(solutions.row(i));
      EXPECT_LE((actual.translation() - T.translation()).norm(), 1e-6);
      EXPECT_LE((actual.linear().col(2) - T.linear().col(2)).norm(), 1e-6);
      EXPECT_TRUE(chain.withinLimits(solutions.row(i), 1e-9));
    }
    found = true;
    return true;
  });
  return found;
}

TEST(RollSearch, FindsWhatTwentyTimesFinerStepsFind) {
  constexpr double kStep = 0.0872664626;
  std::mt19937 random(2);
  int views = 0, missed = 0, missed_by_steps = 0;
  for (const ik::SerialChain& chain : {sphericalShoulder(1.0), sphericalShoulder(0.4), sphericalWrist()}) {
    const auto search = RollSearch::make(chain, {}, {kStep, kStep, true}, false);
    const auto steps = RollSearch::make(chain, {}, {kStep, kStep, false}, false);
    const auto fine = RollSearch::make(chain, {}, {kStep / 20.0, kStep, false}, false);
    ASSERT_TRUE(search && steps && fine);
    const ik::ReachBound bound = ik::reachBound(chain);
    for (int i = 0; i < 4000; ++i) {
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      std::normal_distribution<double> normal;
      T.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                       .normalized()
                       .toRotationMatrix();
      std::uniform_real_distribution<double> within(-bound.radius_m, bound.radius_m);
      T.translation() = bound.center + Vector3d(within(random), within(random), within(random));
      if (!held(*fine, T, chain)) continue;
      ++views;
      missed += held(*search, T, chain) ? 0 : 1;
      missed_by_steps += held(*steps, T, chain) ? 0 : 1;
    }
  }
  EXPECT_GT(views, 1000);
  EXPECT_GT(missed_by_steps, 10);  // the windows that this is about
  EXPECT_LE(missed, missed_by_steps / 8);
}

TEST(RollSearch, IsForArmsWithoutAJointForTheRoll) {
  const ik::SerialChain arm = sphericalShoulder(1.0);
  std::vector<ik::ChainJoint> joints{joint({0, 0, 1}, {0.1, 0, -0.2}, -1.0, 1.0)};
  joints.insert(joints.end(), arm.joints().begin(), arm.joints().end());
  const ik::SerialChain waist_and_arm(joints, arm.zeroPose());
  const auto search = RollSearch::make(waist_and_arm, {}, {0.2, 0.2, true}, false);
  ASSERT_TRUE(search);
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i)
    EXPECT_TRUE(held(*search, waist_and_arm.forward(randomConfiguration(waist_and_arm, random).data()),
                     waist_and_arm));
  joints.resize(5);
  EXPECT_FALSE(RollSearch::make(ik::SerialChain(joints, arm.zeroPose()), {}, {0.2, 0.2, true}, false));
}

}  // namespace
}  // namespace capability_map
