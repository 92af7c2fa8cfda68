#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "example_robot.h"
#include "fv_robot_model/self_filter.h"

namespace fv_robot_model {
namespace {

using testing::exampleRobot;
using testing::randomConfiguration;
using testing::randomPoints;

/// Distance to the body as the filter should see it, every shape looked at.
double gapTo(const SelfFilter& filter, const LinkPoses& poses, const Eigen::Vector3d& p_root) {
  double gap = std::numeric_limits<double>::infinity();
  for (const SelfFilter::Body& body : filter.bodies())
    gap = std::min(
        gap, signedDistance(body.shape, (poses[body.link] * body.shape.T_link_shape).inverse() * p_root) -
                 body.padding_m);
  return gap;
}

/// Smallest gap along the last `shadow_m` of the ray, in steps of 0.1 mm.
double gapBefore(const SelfFilter& filter, const LinkPoses& poses, const Eigen::Vector3d& p_root,
                 const Eigen::Vector3d& sensor_root, double shadow_m) {
  const Eigen::Vector3d ray = sensor_root - p_root;
  double gap = std::numeric_limits<double>::infinity();
  for (double s = 0.0; s <= std::min(shadow_m, ray.norm()); s += 1e-4)
    gap = std::min(gap, gapTo(filter, poses, p_root + s * ray.normalized()));
  return gap;
}

TEST(SelfFilter, robotIsWhatLiesWithinThePadding) {
  const RobotModel model = exampleRobot();
  const SelfFilter filter(model);
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const LinkPoses poses = model.forward(randomConfiguration(model, random));
    const Points points = randomPoints(3000, 0.8, random);
    const auto mask = filter.isRobot(points, poses);
    int robot = 0;
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      EXPECT_EQ(mask[i] == 1, gapTo(filter, poses, points.row(i).transpose()) <= 0.0);
      robot += mask[i];
    }
    EXPECT_GT(robot, 0);
  }
}

TEST(SelfFilter, labelsAgreeWithSampledRays) {
  const RobotModel model = exampleRobot();
  const SelfFilterConfig config;
  const SelfFilter filter(model, config);
  std::mt19937 random(2);
  int shadows = 0;
  for (int trial = 0; trial < 4; ++trial) {
    const LinkPoses poses = model.forward(randomConfiguration(model, random));
    const Eigen::Isometry3d T_root_sensor = testing::randomPose(1.5, random);
    const Points points_root = randomPoints(1500, 0.7, random);
    const Points points_sensor =
        (points_root.rowwise() - T_root_sensor.translation().transpose()) * T_root_sensor.linear();
    const auto labels = filter.classify(points_sensor, T_root_sensor, poses);
    for (Eigen::Index i = 0; i < points_root.rows(); ++i) {
      const Eigen::Vector3d p = points_root.row(i).transpose();
      const double gap = gapTo(filter, poses, p);
      if (std::abs(gap) < 1e-9) continue;
      EXPECT_EQ(labels[i] == PointClass::Robot, gap < 0.0);
      if (gap < 0.0) continue;
      const double before = gapBefore(filter, poses, p, T_root_sensor.translation(), config.shadow_m);
      if (before < 0.0) {
        EXPECT_EQ(labels[i], PointClass::Shadow);
      } else if (before > 0.7e-3) {
        EXPECT_EQ(labels[i], PointClass::Scene);
      }
      shadows += labels[i] == PointClass::Shadow ? 1 : 0;
    }
  }
  EXPECT_GT(shadows, 20);
}

TEST(SelfFilter, shadowLiesBehindTheBodyNotBeforeIt) {
  const RobotModel model = RobotModel::fromXml(
      R"(<robot name="r"><link name="a"><collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>)",
      "");
  const SelfFilter filter(model, {0.01, 1.0, 0.05, {}});
  Eigen::Isometry3d T_root_sensor = Eigen::Isometry3d::Identity();
  T_root_sensor.translation() = Eigen::Vector3d(0.0, 0.0, -1.0);  // looks along z at the ball in the origin
  Points points(6, 3);
  points << 0, 0, 0.85,  //
      0, 0, 0.91,        //
      0, 0, 1.13,        //
      0, 0, 1.17,        //
      0.12, 0, 1.0,      //
      std::numeric_limits<double>::quiet_NaN(), 0, 1.0;
  const std::vector<PointClass> expected{PointClass::Scene, PointClass::Robot, PointClass::Shadow,
                                         PointClass::Scene, PointClass::Scene, PointClass::Invalid};
  EXPECT_EQ(filter.classify(points, T_root_sensor, model.forward(Eigen::VectorXd(0))), expected);
}

TEST(SelfFilter, linksMayDiffer) {
  const RobotModel model = exampleRobot();
  const LinkPoses poses = model.forward(Eigen::VectorXd::Zero(5));
  const Eigen::Vector3d hand = poses[model.linkIndex("hand")].translation();
  Points point(1, 3);
  point << hand.x(), hand.y(), hand.z() + 0.06 + 0.05;  // 5 cm above the hand's ball
  LinkFilterConfig wide;
  wide.padding_m = 0.06;
  LinkFilterConfig large;
  large.scale = 1.5;
  LinkFilterConfig ignored;
  ignored.ignore = true;
  EXPECT_EQ(SelfFilter(model, {}).isRobot(point, poses)[0], 0);
  EXPECT_EQ(SelfFilter(model, {0.03, 1.0, 0.0, {{"hand", wide}}}).isRobot(point, poses)[0], 1);
  EXPECT_EQ(SelfFilter(model, {0.03, 1.0, 0.0, {{"hand", large}}}).isRobot(point, poses)[0], 1);
  EXPECT_EQ(SelfFilter(model, {0.06, 1.0, 0.0, {{"hand", ignored}}}).isRobot(point, poses)[0], 0);
}

TEST(SelfFilter, noPointsAreAnAnswer) {
  const RobotModel model = exampleRobot();
  const LinkPoses poses = model.forward(Eigen::VectorXd::Zero(5));
  EXPECT_TRUE(SelfFilter(model).classify(Points(0, 3), Eigen::Isometry3d::Identity(), poses).empty());
  const Points none = Points::Constant(200, 3, std::numeric_limits<double>::quiet_NaN());
  for (const PointClass label : SelfFilter(model).classify(none, Eigen::Isometry3d::Identity(), poses))
    EXPECT_EQ(label, PointClass::Invalid);
}

TEST(SelfFilter, refusesBadInput) {
  const RobotModel model = exampleRobot();
  EXPECT_THROW(SelfFilter(model, {-0.1, 1.0, 0.0, {}}), std::invalid_argument);
  EXPECT_THROW(SelfFilter(model, {0.1, 0.0, 0.0, {}}), std::invalid_argument);
  EXPECT_THROW(SelfFilter(model, {0.1, 1.0, std::numeric_limits<double>::infinity(), {}}),
               std::invalid_argument);
  EXPECT_THROW(SelfFilter(model, {0.1, 1.0, 0.0, {{"leg", {}}}}), UnknownNameError);
  const SelfFilter filter(model);
  EXPECT_THROW(filter.isRobot(Points(1, 3), LinkPoses(2)), std::invalid_argument);
  LinkPoses poses = model.forward(Eigen::VectorXd::Zero(5));
  poses[3].translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(filter.isRobot(Points::Zero(1, 3), poses), std::invalid_argument);
}

}  // namespace
}  // namespace fv_robot_model
