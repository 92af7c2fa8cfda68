// The core alone: directions, queries, shapes, against slow oracles.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "capability_map/capability_query.h"
#include "capability_map/direction_lookup.h"
#include "capability_map/shape_fit.h"
#include "capability_map/sphere_grid.h"
#include "view_direction.h"

namespace capability_map {
namespace {

Eigen::Vector3d randomUnit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

TEST(DirectionLookup, NearestIsTheNearestOfAll) {
  const Points points = spiralPoints(40);
  const DirectionLookup lookup(points, 0.5);
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d d = randomUnit(random);
    Eigen::Index best = 0;
    const double cosine = (points * d).maxCoeff(&best);
    EXPECT_NEAR(points.row(lookup.nearest(d)).dot(d), cosine, 1e-12);
  }
}

TEST(DirectionLookup, AroundMissesNoneWithinReach) {
  const Points points = spiralPoints(100);
  for (const double reach : {0.1, 0.5, 2.0}) {
    const DirectionLookup lookup(points, reach);
    std::mt19937 random(2);
    for (int i = 0; i < 5000; ++i) {
      const Eigen::Vector3d d = randomUnit(random);
      std::vector<bool> listed(100, false);
      for (const int32_t k : lookup.around(d)) listed[static_cast<size_t>(k)] = true;
      for (Eigen::Index k = 0; k < points.rows(); ++k) {
        const bool within = points.row(k).dot(d) > std::cos(reach);
        EXPECT_TRUE(listed[static_cast<size_t>(k)] || !within);
      }
    }
  }
}

TEST(DirectionLookup, RefusesDirectionsThatAreNone) {
  Points points = spiralPoints(12);
  EXPECT_THROW(DirectionLookup(points, 0.0), std::invalid_argument);
  EXPECT_THROW(DirectionLookup(points, std::nan("")), std::invalid_argument);
  EXPECT_THROW(DirectionLookup(Points(0, 3), 0.5), std::invalid_argument);
  points(3, 0) = 5.0;
  EXPECT_THROW(DirectionLookup(points, 0.5), std::invalid_argument);
}

TEST(ViewDirection, IsTheSameForEveryLength) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::mt19937 random(4);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d d = randomUnit(random);
    EXPECT_EQ(viewDirection(origin, d), d / d.norm());  // the plain way, to the bit
    for (const double length : {7.0, 1e-9, 1e-160, 1e-300, 1e160, 1e300}) {
      EXPECT_LT((viewDirection(origin, length * d) - d).norm(), 1e-15 * 8) << length;
    }
  }
  const double least = std::numeric_limits<double>::denorm_min();
  const double most = std::numeric_limits<double>::max();
  EXPECT_EQ(viewDirection(origin, {0.0, -least, 0.0}), Eigen::Vector3d(0.0, -1.0, 0.0));
  EXPECT_NEAR(viewDirection(origin, {most, most, most}).x(), std::sqrt(1.0 / 3.0), 1e-15);
}

TEST(ViewDirection, RefusesWhereNoneIsLeft) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), inf, -inf}) {
    EXPECT_THROW(viewDirection(origin, {0.0, bad, 1.0}), std::invalid_argument);
    EXPECT_THROW(viewDirection({bad, 0.0, 0.0}, up), std::invalid_argument);
  }
  EXPECT_THROW(viewDirection(origin, origin), std::invalid_argument);
  EXPECT_THROW(viewDirection(origin, -origin), std::invalid_argument);
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
  SphereGrid grid;
  grid.radius_m = 0.1;
  grid.size = {1, 1, 2};
  const auto make = [&](const SphereBits& bits) { return CapabilityQuery(grid, points, bits, {}); };
  EXPECT_NO_THROW(make({{0, -1}, {1}, 1}));
  EXPECT_THROW(make({{0}, {1}, 1}), std::invalid_argument);      // a cell is missing
  EXPECT_THROW(make({{0, 1}, {1}, 1}), std::invalid_argument);   // no such row
  EXPECT_THROW(make({{0, -1}, {1}, 2}), std::invalid_argument);  // too many words
  const ArmPivots nowhere{std::nan(""), Eigen::Vector3d::Zero()};
  EXPECT_THROW(CapabilityQuery(grid, points, {{0, -1}, {1}, 1}, nowhere), std::invalid_argument);
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
