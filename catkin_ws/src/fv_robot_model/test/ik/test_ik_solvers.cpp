// One property suite for every inverse kinematics solver, on arms of each family.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fv_robot_model/ik/ik_solver.h"

namespace fv_robot_model::ik {
namespace {

using Eigen::Vector3d;

struct Arm {
  std::string label;
  std::string family;
  SerialChain chain;
  int poses;  // numerical and swept solvers get fewer
};

ChainJoint joint(const std::string& name, const Vector3d& axis, const Vector3d& point, double lower,
                 double upper) {
  ChainJoint j;
  j.name = name;
  j.axis = axis.normalized();
  j.point = point;
  j.lower = lower;
  j.upper = upper;
  return j;
}

Eigen::Isometry3d zeroPose(const Vector3d& tip) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = tip;
  T.linear() = Eigen::AngleAxisd(0.7, Vector3d(1.0, -2.0, 0.5).normalized()).toRotationMatrix();
  return T;
}

SerialChain sphericalShoulder() {
  const Vector3d S(0.0123, -0.211, 0.0486);
  return SerialChain({joint("s1", {0, 1, 0}, S, -3.14, 3.14), joint("s2", {1, 0, 0}, S, -3.14, 0.0),
                      joint("s3", {0, 0, 1}, S, -3.14, 3.14),
                      joint("e", {0, 1, 0}, S + Vector3d(0.022, 0.018, -0.182), -2.5, 0.07),
                      joint("w1", {0, 0, 1}, S + Vector3d(0, 0, -0.29), -3.14, 3.14),
                      joint("w2", {0, 1, 0}, S + Vector3d(0, 0.01, -0.346), -1.64, 1.01)},
                     zeroPose(S + Vector3d(0.03, 0.0, -0.45)));
}

SerialChain sphericalWrist() {  // as most industrial arms: offset shoulder, parallel second and third axis
  const Vector3d W(0.9, 0, 1.2);
  return SerialChain(
      {joint("a1", {0, 0, 1}, {0, 0, 0}, -3.0, 3.0), joint("a2", {0, 1, 0}, {0.15, 0, 0.5}, -2.0, 2.0),
       joint("a3", {0, 1, 0}, {0.15, 0, 1.1}, -2.5, 2.5), joint("a4", {1, 0, 0}, W, -3.1, 3.1),
       joint("a5", {0, 1, 0}, W, -2.0, 2.0), joint("a6", {1, 0, 0}, W, -6.2, 6.2)},
      zeroPose({1.0, 0, 1.2}));
}

SerialChain generalWrist() {  // three skew axes before the wrist: the quartic
  const Vector3d W(0.3, -0.8, 0.4);
  return SerialChain(
      {joint("a1", {1, 2, 3}, {0.1, 0.2, -0.3}, -2.9, 2.9),
       joint("a2", {-1, 1, 0.3}, {0.4, -0.1, 0.2}, -2.9, 2.9),
       joint("a3", {0.2, 0.1, -1}, {-0.2, 0.5, 0.3}, -2.9, 2.9), joint("a4", {1, 0.2, 0}, W, -2.9, 2.9),
       joint("a5", {0.3, 1, 0.1}, W, -2.9, 2.9), joint("a6", {0, 0.4, 1}, W, -2.9, 2.9)},
      zeroPose({0.2, 0.3, 0.9}));
}

SerialChain shoulderElbowWrist(double share_of_limits) {
  const auto limit = [share_of_limits](double value) { return share_of_limits * value; };
  const Vector3d S(0, 0, 0.36), W(0, 0, 1.18);
  return SerialChain({joint("j1", {0, 0, 1}, S, -limit(2.96), limit(2.96)),
                      joint("j2", {0, 1, 0}, S, -limit(2.09), limit(2.09)),
                      joint("j3", {0, 0, 1}, S, -limit(2.96), limit(2.96)),
                      joint("j4", {0, -1, 0}, {0, 0, 0.78}, -limit(2.09), limit(2.09)),
                      joint("j5", {0, 0, 1}, W, -limit(2.96), limit(2.96)),
                      joint("j6", {0, 1, 0}, W, -limit(2.09), limit(2.09)),
                      joint("j7", {0, 0, 1}, W, -limit(3.05), limit(3.05))},
                     zeroPose({0.03, 0.02, 1.26}));
}

SerialChain youBot() {
  return SerialChain(
      {joint("j1", {0, 0, -1}, {0, 0, 0.1}, -2.9, 2.9), joint("j2", {0, 1, 0}, {0.033, 0, 0.25}, -1.1, 1.6),
       joint("j3", {0, -1, 0}, {0.033, 0, 0.40}, -2.5, 2.6),
       joint("j4", {0, 1, 0}, {0.033, 0, 0.54}, -1.8, 1.7),
       joint("j5", {0, 0, 1}, {0.033, 0, 0.6}, -2.9, 2.9)},
      zeroPose({0.033, 0, 0.75}));
}

SerialChain waistAndArm() {
  const SerialChain arm = sphericalShoulder();
  std::vector<ChainJoint> joints{joint("waist", {0, 0, -1}, {0.012, 0.002, -0.15}, -3.1, 3.1)};
  joints.insert(joints.end(), arm.joints().begin(), arm.joints().end());
  return SerialChain(joints, arm.zeroPose());
}

SerialChain withPrismatic() {
  ChainJoint slide = joint("slide", {0, 0, 1}, {0, 0, 0}, 0.0, 0.3);
  slide.prismatic = true;
  return SerialChain(
      {slide, joint("a", {0, 0, 1}, {0, 0, 0}, -2, 2), joint("b", {0, 1, 0}, {0.3, 0, 0.1}, -2, 2),
       joint("c", {1, 0, 0}, {0.6, 0, 0.1}, -2, 2), joint("d", {0, 1, 0.3}, {0.8, 0, 0.1}, -2, 2),
       joint("e", {0.3, 0, 1}, {0.9, 0.1, 0.1}, -2, 2)},
      zeroPose({1.0, 0, 0.1}));
}

class IkSolverSuite : public testing::TestWithParam<Arm> {
 protected:
  std::vector<double> randomConfiguration(std::mt19937& random) const {
    std::vector<double> q;
    for (const ChainJoint& j : GetParam().chain.joints()) {
      q.push_back(std::uniform_real_distribution<double>(j.lower, j.upper)(random));
    }
    return q;
  }
};

TEST_P(IkSolverSuite, ChoosesTheFamilyAndSaysWhy) {
  const auto solver = makeIkSolver(GetParam().chain);
  EXPECT_EQ(solver->family(), GetParam().family);
  EXPECT_NE(solver->name().find("because"), std::string::npos);
}

TEST_P(IkSolverSuite, FindsEveryReachablePoseAndEverySolutionHolds) {
  const auto solver = makeIkSolver(GetParam().chain);
  std::mt19937 random(3);
  int missed = 0;
  for (int i = 0; i < GetParam().poses; ++i) {
    const Eigen::Isometry3d T = solver->chain().forward(randomConfiguration(random).data());
    IkSolutions solutions(solver->chain().dof());
    solver->solvePose(T, nullptr, solutions);
    missed += solutions.empty() ? 1 : 0;
    for (int row = 0; row < solutions.size(); ++row) {
      const Eigen::Isometry3d actual = solver->chain().forward(solutions.row(row));
      EXPECT_LE((actual.translation() - T.translation()).norm(), 1e-6);
      EXPECT_LE(Eigen::AngleAxisd(actual.linear() * T.linear().transpose()).angle(), 2e-6);
      EXPECT_TRUE(solver->chain().withinLimits(solutions.row(row), 1e-9));
    }
  }
  EXPECT_LE(missed, solver->exact() ? 0 : GetParam().poses / 100);
}

TEST_P(IkSolverSuite, ListsTheConfigurationThatMadeThePoseWhenNothingIsRedundant) {
  if (GetParam().chain.dof() > 6) GTEST_SKIP() << "redundant: one of infinitely many";
  const auto solver = makeIkSolver(GetParam().chain);
  if (!solver->exact()) GTEST_SKIP() << "numerical: some branches may be missing";
  std::mt19937 random(4);
  for (int i = 0; i < GetParam().poses; ++i) {
    const std::vector<double> q = randomConfiguration(random);
    IkSolutions solutions(solver->chain().dof());
    solver->solvePose(solver->chain().forward(q.data()), nullptr, solutions);
    double nearest = 1e9;
    for (int row = 0; row < solutions.size(); ++row) {
      double largest = 0.0;  // whole turns apart is the same arm
      for (size_t k = 0; k < q.size(); ++k) {
        largest = std::max(largest, std::abs(std::remainder(solutions.row(row)[k] - q[k], 2.0 * M_PI)));
      }
      nearest = std::min(nearest, largest);
    }
    EXPECT_LE(nearest, 1e-4) << "pose " << i;
  }
}

TEST_P(IkSolverSuite, GivesNothingBeyondReachAndTheSameTwice) {
  const auto solver = makeIkSolver(GetParam().chain);
  const ReachBound bound = reachBound(solver->chain());
  Eigen::Isometry3d far = solver->chain().zeroPose();
  far.translation() = bound.center + Vector3d(0.0, 1.01 * bound.radius_m, 0.0);
  EXPECT_EQ(solver->solve({far}).joints.rows(), 0);
  std::mt19937 random(5);
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 5; ++i) poses.push_back(solver->chain().forward(randomConfiguration(random).data()));
  const IkBatch first = solver->solve(poses);
  const IkBatch second = solver->solve(poses);
  EXPECT_EQ(first.offsets, second.offsets);
  EXPECT_EQ(first.joints, second.joints);
}

TEST_P(IkSolverSuite, ListsTheNearestToTheSeedFirst) {
  const auto solver = makeIkSolver(GetParam().chain);
  std::mt19937 random(6);
  const std::vector<double> q = randomConfiguration(random);
  const Eigen::Map<const Eigen::RowVectorXd> seed(q.data(), static_cast<Eigen::Index>(q.size()));
  const IkBatch batch = solver->solve({solver->chain().forward(q.data())}, seed);
  ASSERT_GT(batch.joints.rows(), 0);
  for (Eigen::Index row = 1; row < batch.joints.rows(); ++row) {
    EXPECT_LE((batch.joints.row(row - 1) - seed).norm(), (batch.joints.row(row) - seed).norm() + 1e-12);
  }
}

TEST_P(IkSolverSuite, RefusesWhatIsNoPose) {
  const auto solver = makeIkSolver(GetParam().chain);
  Eigen::Isometry3d bad = Eigen::Isometry3d::Identity();
  bad.translation().x() = std::nan("");
  EXPECT_THROW(solver->solve({Eigen::Isometry3d::Identity(), bad}), std::invalid_argument);
  bad = Eigen::Isometry3d::Identity();
  bad.linear() *= 1.1;
  EXPECT_THROW(solver->solve({bad}), std::invalid_argument);
  EXPECT_THROW(solver->solve({Eigen::Isometry3d::Identity()}, Eigen::MatrixXd::Zero(2, 2)),
               std::invalid_argument);
}

TEST_P(IkSolverSuite, JacobianIsTheDerivativeOfForward) {
  const SerialChain& chain = GetParam().chain;
  std::mt19937 random(7);
  std::vector<double> q = randomConfiguration(random);
  const auto J = chain.jacobian(q.data());
  constexpr double kStep = 1e-6;
  for (int k = 0; k < chain.dof(); ++k) {
    std::vector<double> low = q, high = q;
    low[static_cast<size_t>(k)] -= kStep;
    high[static_cast<size_t>(k)] += kStep;
    const Eigen::Isometry3d A = chain.forward(low.data()), B = chain.forward(high.data());
    const Eigen::AngleAxisd turn(B.linear() * A.linear().transpose());
    Eigen::Matrix<double, 6, 1> expected;
    expected << (B.translation() - A.translation()) / (2.0 * kStep),
        turn.axis() * turn.angle() / (2.0 * kStep);
    EXPECT_LE((J.col(k) - expected).norm(), 1e-5);
  }
}

TEST_P(IkSolverSuite, ReachBoundHolds) {
  const ReachBound bound = reachBound(GetParam().chain);
  std::mt19937 random(8);
  double farthest = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d tip = GetParam().chain.forward(randomConfiguration(random).data()).translation();
    farthest = std::max(farthest, (tip - bound.center).norm());
  }
  EXPECT_LE(farthest, bound.radius_m + 1e-9);
  EXPECT_GE(farthest, 0.6 * bound.radius_m);  // and it is not a bound for the sake of one
}

INSTANTIATE_TEST_SUITE_P(
    Arms, IkSolverSuite,
    testing::Values(Arm{"SphericalShoulder", "spherical-shoulder-6R", sphericalShoulder(), 5000},
                    Arm{"SphericalWrist", "spherical-wrist-6R", sphericalWrist(), 5000},
                    Arm{"GeneralWrist", "spherical-wrist-6R", generalWrist(), 5000},
                    Arm{"ShoulderElbowWrist", "shoulder-elbow-wrist-7R", shoulderElbowWrist(1.0), 300},
                    Arm{"NarrowShoulderElbowWrist", "shoulder-elbow-wrist-7R", shoulderElbowWrist(0.15),
                        3000},
                    Arm{"YouBot", "parallel-5R", youBot(), 5000},
                    Arm{"WaistAndArm", "sweep+spherical-shoulder-6R", waistAndArm(), 1000},
                    Arm{"Prismatic", "kdl", withPrismatic(), 100}),
    [](const auto& info) { return info.param.label; });

TEST(Parallel5R, TurnsTheDirectionWithinTheToleranceOnly) {
  // Last axis through the tip; a direction 3 degrees out of the arm's plane.
  IkOptions options;
  options.direction_tolerance_rad = 0.1;
  SerialChain chain = youBot();
  const auto solver = makeIkSolver(chain, options);
  const double q[] = {0.4, 0.3, -0.8, 0.5, 0.2};
  const Eigen::Isometry3d exact = chain.forward(q);
  for (const double miss : {0.05, 0.15}) {
    Eigen::Isometry3d T = exact;
    // The plane's normal turns with joint 1, whose axis points down.
    const Vector3d normal = Eigen::AngleAxisd(-q[0], Vector3d::UnitZ()) * Vector3d::UnitY();
    const Vector3d last = exact.linear() * chain.zeroPose().linear().transpose() * Vector3d::UnitZ();
    T.linear() = Eigen::AngleAxisd(miss, last.cross(normal).normalized()).toRotationMatrix() * T.linear();
    IkSolutions solutions(5);
    solver->solvePose(T, nullptr, solutions);
    EXPECT_EQ(solutions.empty(), miss > options.direction_tolerance_rad);
    for (int row = 0; row < solutions.size(); ++row) {
      EXPECT_LE((chain.forward(solutions.row(row)).translation() - T.translation()).norm(), 1e-6);
    }
  }
}

TEST(JointSweep, FinerStepsFindWhatOnlyANarrowWindowOfTheWaistCanHold) {
  const SerialChain chain = waistAndArm();
  std::mt19937 random(9);
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 5000; ++i) {
    std::vector<double> q;
    for (const ChainJoint& j : chain.joints()) {
      q.push_back(std::uniform_real_distribution<double>(j.lower, j.upper)(random));
    }
    poses.push_back(chain.forward(q.data()));
  }
  const auto missed = [&](int refinements) {
    IkOptions options;
    options.sweep_refinements = refinements;
    const IkBatch batch = makeIkSolver(chain, options)->solve(poses);
    int none = 0;
    for (size_t i = 0; i < poses.size(); ++i) none += batch.offsets[i] == batch.offsets[i + 1] ? 1 : 0;
    return none;
  };
  EXPECT_GT(missed(0), 10);
  EXPECT_LT(missed(1), missed(0));
  EXPECT_LE(missed(IkOptions().sweep_refinements), 1);
  EXPECT_THROW(missed(-1), std::invalid_argument);
}

TEST(SerialChain, RefusesWhatIsNoArm) {
  const Eigen::Isometry3d I = Eigen::Isometry3d::Identity();
  EXPECT_THROW(SerialChain({}, I), std::invalid_argument);
  ChainJoint bent = joint("bent", {0, 0, 1}, {0, 0, 0}, -1, 1);
  bent.axis *= 2.0;
  EXPECT_THROW(SerialChain({bent}, I), std::invalid_argument);
  EXPECT_THROW(SerialChain({joint("wrong", {0, 0, 1}, {0, 0, 0}, 1, -1)}, I), std::invalid_argument);
  EXPECT_THROW(SerialChain({joint("nan", {0, 0, 1}, {0, 0, 0}, std::nan(""), 1)}, I), std::invalid_argument);
}

TEST(FitToLimits, BringsAnglesIntoRangeByWholeTurns) {
  double angle = 3.0;
  EXPECT_TRUE(fitToLimits(angle, -4.0, -3.0, 1e-9));
  EXPECT_NEAR(angle, 3.0 - 2.0 * M_PI, 1e-12);
  angle = 2.0;
  EXPECT_FALSE(fitToLimits(angle, -1.0, 1.0, 1e-9));
  angle = 1.0 + 5e-10;
  EXPECT_TRUE(fitToLimits(angle, -1.0, 1.0, 1e-9));
  EXPECT_EQ(angle, 1.0);
  angle = std::nan("");
  EXPECT_FALSE(fitToLimits(angle, -1.0, 1.0, 1e-9));
}

}  // namespace
}  // namespace fv_robot_model::ik
