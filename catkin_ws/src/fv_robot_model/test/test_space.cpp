/// Body voxels and sphere covers against sampling.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "body_voxels.h"
#include "example_robot.h"
#include "fv_robot_model/sphere_cover.h"

namespace fv_robot_model {
namespace {

using testing::exampleRobot;
using testing::randomConfiguration;
using testing::randomPoints;
using testing::randomPose;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double gapTo(const RobotModel& model, const LinkPoses& poses, const Eigen::Vector3d& p_root) {
  double gap = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < poses.size(); ++i)
    for (const Shape& shape : model.shapes(static_cast<int>(i)))
      gap = std::min(gap, signedDistance(shape, (poses[i] * shape.T_link_shape).inverse() * p_root));
  return gap;
}

/// Smallest gap over a lattice of points of the voxel, its corners included.
double sampledGap(const RobotModel& model, const LinkPoses& poses, const Eigen::Isometry3d& T_root_map,
                  const Eigen::Vector3d& center, double resolution) {
  constexpr int kSteps = 4;
  double gap = std::numeric_limits<double>::infinity();
  for (int x = 0; x <= kSteps; ++x)
    for (int y = 0; y <= kSteps; ++y)
      for (int z = 0; z <= kSteps; ++z) {
        const Eigen::Vector3d offset = Eigen::Vector3d(x, y, z) / kSteps - Eigen::Vector3d::Constant(0.5);
        gap = std::min(gap, gapTo(model, poses, T_root_map * (center + resolution * offset)));
      }
  return gap;
}

TEST(BodyVoxels, agreeWithSampledVoxels) {
  const RobotModel model = exampleRobot();
  std::mt19937 random(1);
  const double resolution = 0.05;
  const double padding = 0.012;
  const double spacing =
      0.5 * std::sqrt(3.0) * resolution / 4;  // no point of a voxel is further from a sample
  for (int trial = 0; trial < 2; ++trial) {
    const LinkPoses poses = model.forward(randomConfiguration(model, random));
    const Eigen::Isometry3d T_map_root = randomPose(0.3, random);
    const Points voxels = bodyVoxels(model, poses, T_map_root, resolution, padding);
    std::set<std::tuple<int, int, int>> keys;
    for (Eigen::Index i = 0; i < voxels.rows(); ++i) {
      const Eigen::Vector3d key = voxels.row(i).transpose() / resolution;
      EXPECT_TRUE(((key.array() - 0.5) - (key.array() - 0.5).round()).abs().maxCoeff() < 1e-9);
      EXPECT_TRUE(keys.emplace(std::floor(key.x()), std::floor(key.y()), std::floor(key.z())).second);
    }
    for (int x = -30; x < 30; ++x)
      for (int y = -30; y < 30; ++y)
        for (int z = -30; z < 30; ++z) {
          const Eigen::Vector3d center = resolution * (Eigen::Vector3d(x, y, z).array() + 0.5);
          const bool listed = keys.count({x, y, z}) != 0;
          if (!listed && gapTo(model, poses, T_map_root.inverse() * center) > 2.0 * resolution) continue;
          const double gap = sampledGap(model, poses, T_map_root.inverse(), center, resolution);
          if (gap <= padding - 1e-6) {
            EXPECT_TRUE(listed);
          }
          if (gap > padding + spacing) {
            EXPECT_FALSE(listed);
          }
        }
    EXPECT_GT(voxels.rows(), 100);
  }
}

TEST(BodyVoxels, ofABoxOnTheGridAreItsCells) {
  const RobotModel model = RobotModel::fromXml(
      R"(<robot name="r"><link name="a"><collision><geometry><box size="0.18 0.18 0.18"/></geometry></collision></link></robot>)",
      "");
  const LinkPoses poses = model.forward(Eigen::VectorXd(0));
  EXPECT_EQ(bodyVoxels(model, poses, Eigen::Isometry3d::Identity(), 0.1, 0.0).rows(), 8);
  EXPECT_EQ(bodyVoxels(model, poses, Eigen::Isometry3d::Identity(), 0.1, 0.015).rows(), 8 + 6 * 4 + 12 * 2);
}

TEST(BodyVoxels, refuseBadInput) {
  const RobotModel model = exampleRobot();
  const LinkPoses poses = model.forward(Eigen::VectorXd::Zero(5));
  const Eigen::Isometry3d I = Eigen::Isometry3d::Identity();
  for (const double bad : {0.0, -0.1, kNan})
    EXPECT_THROW(bodyVoxels(model, poses, I, bad, 0.0), std::invalid_argument);
  EXPECT_THROW(bodyVoxels(model, poses, I, 0.05, -0.1), std::invalid_argument);
  EXPECT_THROW(bodyVoxels(model, poses, I, 1e-5, 0.0), std::invalid_argument);  // far too many
  EXPECT_THROW(bodyVoxels(model, LinkPoses(1), I, 0.05, 0.0), std::invalid_argument);
}

TEST(SphereCover, containsTheShape) {
  std::mt19937 random(2);
  const Eigen::Isometry3d T = randomPose(0.5, random);
  for (const Shape& shape :
       {Shape::box({0.3, 0.2, 0.02}, T), Shape::cylinder(0.05, 0.4, T), Shape::cylinder(0.2, 0.05, T),
        Shape::sphere(0.15, T), Shape::convexHull(randomPoints(30, 0.2, random), T)})
    for (const double max_radius : {0.03, 0.06, 0.2, 1.0}) {
      const Spheres balls = sphereCover(shape, max_radius);
      for (const Sphere& ball : balls) EXPECT_LE(ball.radius, max_radius + 1e-12);
      const Points samples = randomPoints(4000, 0.25, random);
      for (Eigen::Index i = 0; i < samples.rows(); ++i) {
        const Eigen::Vector3d p =
            closestPoint(shape, samples.row(i).transpose());  // often right on the surface
        bool covered = false;
        for (const Sphere& ball : balls)
          covered = covered || (T * p - ball.center).norm() <= ball.radius + 1e-9;
        EXPECT_TRUE(covered);
      }
    }
}

TEST(SphereCover, isNotWasteful) {
  const Eigen::Isometry3d I = Eigen::Isometry3d::Identity();
  EXPECT_EQ(sphereCover(Shape::sphere(0.1, I), 0.1).size(), 1U);
  EXPECT_EQ(sphereCover(Shape::box({0.1, 0.1, 0.1}, I), 0.1).size(), 1U);
  EXPECT_LE(sphereCover(Shape::cylinder(0.05, 0.4, I), 0.06).size(), 7U);
}

TEST(SphereCover, ofALinkCoversAllItsShapes) {
  const RobotModel model = exampleRobot();
  EXPECT_TRUE(sphereCover(model, model.linkIndex("finger_left"), 0.05).empty());
  EXPECT_FALSE(sphereCover(model, model.linkIndex("arm"), 0.05).empty());
  EXPECT_THROW(sphereCover(model, 99, 0.05), std::out_of_range);
  for (const double bad : {0.0, -1.0, kNan, 1e-5})
    EXPECT_THROW(sphereCover(model, 0, bad), std::invalid_argument);
}

}  // namespace
}  // namespace fv_robot_model
