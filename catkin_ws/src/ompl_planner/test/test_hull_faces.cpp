/// Quick answers about hulls against slow ones: the furthest face against all faces, voxels against FCL.
#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <fv_robot_model/fcl_geometry.h>
#include <gtest/gtest.h>

#include <random>

#include "hull_faces.h"
#include "world_collision.h"

namespace ompl_planner {
namespace {

using fv_robot_model::Points;
using fv_robot_model::Shape;

constexpr double kResolution = 0.02;

Eigen::Vector3d randomVector(double half, std::mt19937& random) {
  std::uniform_real_distribution<double> at(-half, half);
  return {at(random), at(random), at(random)};
}

/// A rounded hull of many faces, or a sharp one of few.
Shape randomHull(int points, double size_m, std::mt19937& random) {
  Points rows(points, 3);
  for (int i = 0; i < points; ++i) {
    rows.row(i) =
        randomVector(1.0, random).normalized().cwiseProduct(Eigen::Vector3d(1.0, 0.7, 1.6)).transpose() *
        size_m;
  }
  return Shape::convexHull(rows, Eigen::Isometry3d::Identity());
}

TEST(HullFaces, FindTheFurthestFaceOfAll) {
  std::mt19937 random(1);
  for (const int points : {6, 30, 600}) {
    const Shape hull = randomHull(points, 0.1, random);
    const HullFaces faces(hull);
    for (int i = 0; i < 20000; ++i) {
      const Eigen::Vector3d p = randomVector(0.35, random);
      const double truth = (hull.planes.leftCols<3>() * p + hull.planes.col(3)).maxCoeff();
      const auto [height, normal] = faces.furthest(p);
      if (truth <= 0.0) {
        EXPECT_LE(height, 0.0) << p.transpose();
      } else {
        EXPECT_NEAR(height, truth, 1e-12) << p.transpose();
        EXPECT_NEAR(normal.norm(), 1.0, 1e-9);
      }
    }
  }
}

TEST(HullFaces, AreAHullsOnly) {
  EXPECT_THROW(HullFaces(Shape::sphere(0.1, Eigen::Isometry3d::Identity())), std::invalid_argument);
}

/// FCL for every obstacle voxel.
bool meetsAnyByFcl(const Shape& hull, const Eigen::Isometry3d& T_map_hull, const VoxelGrid& grid) {
  const auto geometry = fv_robot_model::fclGeometry(hull);
  const fcl::Boxd voxel(kResolution, kResolution, kResolution);
  for (std::size_t i = 0; i < grid.count(); ++i) {
    if (grid.atOffset(i) == Voxel::Free) continue;
    Eigen::Isometry3d T_map_voxel = Eigen::Isometry3d::Identity();
    T_map_voxel.translation() = grid.centerOf(grid.indexAt(i));
    fcl::CollisionResultd result;
    if (fcl::collide(geometry.get(), T_map_hull, &voxel, T_map_voxel, fcl::CollisionRequestd(), result) > 0)
      return true;
  }
  return false;
}

TEST(HullFaces, GiveTheJudgeFclsAnswers) {
  std::mt19937 random(2);
  VoxelGrid grid(kResolution,
                 Eigen::AlignedBox3d(Eigen::Vector3d::Constant(-0.4), Eigen::Vector3d::Constant(0.39)));
  for (std::size_t i = 0; i < grid.count(); ++i)
    grid.setOffset(i, random() % 100 == 0 ? Voxel::Occupied : Voxel::Free);
  const auto shared_grid = std::make_shared<VoxelGrid>(grid);
  const auto blocks = std::make_shared<ObstacleBlocks>(grid);
  int met = 0;
  for (int round = 0; round < 400; ++round) {
    const Shape hull = randomHull(round % 2 == 0 ? 6 : 150, 0.03, random);
    const CollisionBody body{hull, fv_robot_model::fclGeometry(hull), fv_robot_model::boundingBox(hull),
                             std::make_shared<HullFaces>(hull)};
    const WorldCollision judge(std::make_shared<LinkBodies>(LinkBodies{{0, {body}}}),
                               Eigen::Isometry3d::Identity(), shared_grid, false, blocks);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.rotate(Eigen::AngleAxisd(2.0, randomVector(1.0, random).normalized()))
        .pretranslate(randomVector(0.25, random));
    const bool answer = judge.contactOf({T}, 0).has_value();
    met += answer;
    if (answer) {
      EXPECT_TRUE(meetsAnyByFcl(fv_robot_model::scaled(hull, 1.001), T, grid)) << round;
    } else {
      EXPECT_FALSE(meetsAnyByFcl(fv_robot_model::scaled(hull, 0.999), T, grid)) << round;
    }
  }
  EXPECT_GT(met, 100);
  EXPECT_LT(met, 300);
}

}  // namespace
}  // namespace ompl_planner
