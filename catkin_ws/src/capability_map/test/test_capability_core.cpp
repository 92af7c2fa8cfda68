// The core alone: directions, queries, shapes, against slow oracles.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "capability_map/capability_query.h"
#include "capability_map/direction_lookup.h"
#include "capability_map/shape_fit.h"
#include "capability_map/sphere_grid.h"

namespace capability_map {
namespace {

using Triangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;

Eigen::Vector3d randomUnit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

/// Convex hull by definition: a triangle whose plane leaves every other point on one side.
Triangles bruteForceHull(const Points& points) {
  std::vector<Eigen::Vector3i> faces;
  for (int a = 0; a < points.rows(); ++a) {
    for (int b = a + 1; b < points.rows(); ++b) {
      for (int c = b + 1; c < points.rows(); ++c) {
        const Eigen::Vector3d A = points.row(a), B = points.row(b), C = points.row(c);
        const Eigen::Vector3d normal = (B - A).cross(C - A);
        const Eigen::VectorXd sides = (points.rowwise() - A.transpose()) * normal;
        if (sides.maxCoeff() < 1e-12 || sides.minCoeff() > -1e-12) faces.emplace_back(a, b, c);
      }
    }
  }
  Triangles hull(static_cast<Eigen::Index>(faces.size()), 3);
  for (size_t i = 0; i < faces.size(); ++i) hull.row(static_cast<Eigen::Index>(i)) = faces[i];
  return hull;
}

TEST(DirectionLookup, NearestIsTheNearestOfAll) {
  const Points points = spiralPoints(40);
  const DirectionLookup lookup(points, bruteForceHull(points));
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d d = randomUnit(random);
    Eigen::Index best = 0;
    const double cosine = (points * d).maxCoeff(&best);
    EXPECT_NEAR(points.row(lookup.nearest(d)).dot(d), cosine, 1e-12);
  }
}

TEST(DirectionLookup, BlendIsTheDirectionItself) {
  const Points points = spiralPoints(40);
  const DirectionLookup lookup(points, bruteForceHull(points));
  std::mt19937 random(2);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d d = randomUnit(random);
    const DirectionLookup::Blend blend = lookup.blend(d);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double total = 0.0;
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_GE(blend.weight[k], 0.0);
      total += blend.weight[k];
      sum += blend.weight[k] * points.row(blend.index[k]).transpose();
    }
    EXPECT_NEAR(total, 1.0, 1e-12);
    EXPECT_LE(sum.normalized().cross(d).norm(), 1e-9);
  }
}

TEST(DirectionLookup, RefusesDirectionsThatAreNone) {
  Points points = spiralPoints(12);
  const Triangles hull = bruteForceHull(points);
  Triangles wrong = hull;
  wrong(0, 0) = 12;
  EXPECT_THROW(DirectionLookup(points, wrong), std::invalid_argument);
  EXPECT_THROW(DirectionLookup(points, hull.topRows(2)), std::invalid_argument);
  points(3, 0) = 5.0;
  EXPECT_THROW(DirectionLookup(points, hull), std::invalid_argument);
}

TEST(SphereGrid, CellsAndCentersAgree) {
  SphereGrid grid;
  grid.origin = {-1.0, 0.5, 2.0};
  grid.radius_m = 0.05;
  grid.size = {3, 4, 5};
  for (int64_t cell = 0; cell < grid.cellCount(); ++cell) EXPECT_EQ(grid.cellAt(grid.center(cell)), cell);
  EXPECT_EQ(grid.cellAt({-1.01, 0.6, 2.1}), -1);
  EXPECT_EQ(grid.cellAt({-0.69, 0.6, 2.1}), -1);
  EXPECT_EQ(grid.cellAt({std::nan(""), 0.6, 2.1}), -1);
}

TEST(CapabilityQuery, RefusesPartsThatDoNotFit) {
  const Points points = spiralPoints(12);
  const Triangles hull = bruteForceHull(points);
  SphereGrid grid;
  grid.radius_m = 0.1;
  grid.size = {1, 1, 2};
  const auto make = [&](SphereBits bits) {
    return CapabilityQuery(grid, DirectionLookup(points, hull), points, std::move(bits), 0.0);
  };
  EXPECT_NO_THROW(make({{0, -1}, {1}, 1}));
  EXPECT_THROW(make({{0}, {1}, 1}), std::invalid_argument);      // a cell is missing
  EXPECT_THROW(make({{0, 1}, {1}, 1}), std::invalid_argument);   // no such row
  EXPECT_THROW(make({{0, -1}, {1}, 2}), std::invalid_argument);  // too many words
}

TEST(ShapeFit, CoverAllCoversAllAndLeastErrorIsNoWorse) {
  const Points points = spiralPoints(200);
  std::mt19937 random(3);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d axis = randomUnit(random);
    const double opening = std::uniform_real_distribution<double>(0.2, 2.5)(random);
    std::vector<bool> valid;
    for (Eigen::Index k = 0; k < points.rows(); ++k) {
      valid.push_back(std::acos(points.row(k).dot(axis)) < opening && random() % 10 != 0);
    }
    for (const ShapeType type : {ShapeType::Cone, ShapeType::DoubleCone, ShapeType::Ring}) {
      const Shape covering = fitShape(points, valid, type, AngleRule::CoverAll);
      for (Eigen::Index k = 0; k < points.rows(); ++k) {
        if (valid[static_cast<size_t>(k)]) {
          EXPECT_TRUE(covering.covers(points.row(k)));
        }
      }
      const Shape best = fitShape(points, valid, type, AngleRule::LeastError);
      EXPECT_LE(best.error_percent, covering.error_percent + 1e-9);
    }
  }
}

TEST(ShapeFit, NothingValidIsEmptyWithoutError) {
  const Shape shape = fitBestShape(spiralPoints(20), std::vector<bool>(20, false), AngleRule::CoverAll);
  EXPECT_EQ(shape.type, ShapeType::Empty);
  EXPECT_EQ(shape.error_percent, 0.0);
  EXPECT_FALSE(shape.covers(Eigen::Vector3d::UnitX()));
}

}  // namespace
}  // namespace capability_map
