#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "example_robot.h"
#include "fv_robot_model/fcl_geometry.h"
#include "fv_robot_model/shape.h"

namespace fv_robot_model {
namespace {

using testing::randomPoints;
using testing::randomPose;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// One of each kind, no two edges alike, none centred on its link.
std::vector<Shape> someShapes(std::mt19937& random) {
  return {Shape::box({0.3, 0.2, 0.1}, randomPose(0.5, random)),
          Shape::cylinder(0.1, 0.4, randomPose(0.5, random)), Shape::sphere(0.15, randomPose(0.5, random)),
          Shape::convexHull(randomPoints(40, 0.2, random), randomPose(0.5, random))};
}

/// Is p inside, by the definition of each kind and nothing else?
bool insideByDefinition(const Shape& shape, const Eigen::Vector3d& p) {
  switch (shape.kind) {
    case Shape::Kind::Box:
      return (p.cwiseAbs().array() <= 0.5 * shape.dimensions.array()).all();
    case Shape::Kind::Cylinder:
      return p.head<2>().norm() <= shape.dimensions[0] && std::abs(p.z()) <= 0.5 * shape.dimensions[1];
    case Shape::Kind::Sphere:
      return p.norm() <= shape.dimensions[0];
    case Shape::Kind::Convex:
      return ((shape.planes.leftCols<3>() * p + shape.planes.col(3)).array() <= 0.0).all();
  }
  return false;
}

/// Points of the solid's surface: where random rays from an inner point leave it, by bisection.
Points surfacePoints(const Shape& shape, Eigen::Index count, std::mt19937& random) {
  const Eigen::Vector3d inner = boundingBox(shape).center();
  Points surface(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d direction = randomPoints(1, 1.0, random).transpose().normalized();
    double low = 0.0;
    double high = 2.0;
    while (high - low > 1e-10) {
      const double middle = 0.5 * (low + high);
      (insideByDefinition(shape, inner + middle * direction) ? low : high) = middle;
    }
    surface.row(i) = (inner + low * direction).transpose();
  }
  return surface;
}

TEST(Shape, signedDistanceAgreesWithSampledSurface) {
  std::mt19937 random(1);
  for (const Shape& shape : someShapes(random)) {
    const Points surface = surfacePoints(shape, 40000, random);
    const Points points = randomPoints(300, 0.4, random);
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      const Eigen::Vector3d p = points.row(i).transpose();
      const double sampled = (surface.rowwise() - p.transpose()).rowwise().norm().minCoeff();
      const double distance = signedDistance(shape, p);
      EXPECT_EQ(distance <= 0.0, insideByDefinition(shape, p));
      EXPECT_LE(std::abs(distance), sampled + 1e-9);  // no sample may be nearer than the nearest point
      EXPECT_GE(std::abs(distance), sampled - 0.008)
          << static_cast<int>(shape.kind);  // spacing of the samples
    }
  }
}

TEST(Shape, closestPointLiesInTheShapeAtTheDistance) {
  std::mt19937 random(2);
  for (const Shape& shape : someShapes(random)) {
    const Points points = randomPoints(1000, 0.5, random);
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      const Eigen::Vector3d p = points.row(i).transpose();
      const Eigen::Vector3d near = closestPoint(shape, p);
      EXPECT_LE(signedDistance(shape, near), 1e-9);
      EXPECT_NEAR((near - p).norm(), std::max(signedDistance(shape, p), 0.0), 1e-9);
    }
  }
}

TEST(Shape, isWithinIsTheDistanceCompared) {
  std::mt19937 random(3);
  for (const Shape& shape : someShapes(random)) {
    const Points points = randomPoints(500, 0.5, random);
    for (Eigen::Index i = 0; i < points.rows(); ++i)
      for (const double limit : {-0.02, 0.0, 0.05, 0.3}) {
        const Eigen::Vector3d p = points.row(i).transpose();
        EXPECT_EQ(isWithin(shape, p, limit), signedDistance(shape, p) <= limit);
      }
  }
}

TEST(Shape, aHullOfABoxesCornersIsTheBox) {
  Points corners(8, 3);
  for (int i = 0; i < 8; ++i)
    corners.row(i) << (i & 1 ? 0.15 : -0.15), (i & 2 ? 0.1 : -0.1), (i & 4 ? 0.05 : -0.05);
  const Shape hull = Shape::convexHull(corners, Eigen::Isometry3d::Identity());
  const Shape box = Shape::box({0.3, 0.2, 0.1}, Eigen::Isometry3d::Identity());
  EXPECT_EQ(hull.vertices.rows(), 8);
  EXPECT_EQ(hull.faces.rows(), 12);
  std::mt19937 random(4);
  const Points points = randomPoints(2000, 0.3, random);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    EXPECT_NEAR(signedDistance(hull, points.row(i).transpose()),
                signedDistance(box, points.row(i).transpose()), 1e-9);
}

TEST(Shape, facesOfAHullTurnOutwards) {
  std::mt19937 random(5);
  const Shape hull = Shape::convexHull(randomPoints(60, 0.3, random), Eigen::Isometry3d::Identity());
  for (Eigen::Index f = 0; f < hull.faces.rows(); ++f) {
    const Eigen::Vector3d a = hull.vertices.row(hull.faces(f, 0)).transpose();
    const Eigen::Vector3d b = hull.vertices.row(hull.faces(f, 1)).transpose();
    const Eigen::Vector3d c = hull.vertices.row(hull.faces(f, 2)).transpose();
    EXPECT_GT((b - a).cross(c - a).dot(hull.planes.row(f).head<3>().transpose()), 0.0);
    EXPECT_NEAR(hull.planes.row(f).head<3>().dot(a) + hull.planes(f, 3), 0.0, 1e-12);
  }
}

TEST(Shape, boundsContainTheShape) {
  std::mt19937 random(6);
  for (const Shape& shape : someShapes(random)) {
    const Sphere ball = boundingSphere(shape);
    const Points surface = surfacePoints(shape, 2000, random);
    for (Eigen::Index i = 0; i < surface.rows(); ++i) {
      const Eigen::Vector3d p = surface.row(i).transpose();
      EXPECT_LE(boundingBox(shape).exteriorDistance(p), 1e-9);
      EXPECT_LE((shape.T_link_shape * p - ball.center).norm(), ball.radius + 1e-9);
    }
  }
}

TEST(Shape, paddedContainsEverythingWithinThePadding) {
  std::mt19937 random(7);
  const double padding = 0.03;
  for (const Shape& shape : someShapes(random)) {
    const Shape grown = padded(shape, padding);
    const Points points = randomPoints(3000, 0.4, random);
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      const Eigen::Vector3d p = points.row(i).transpose();
      const double distance = signedDistance(shape, p);
      if (distance <= padding) {
        EXPECT_LE(signedDistance(grown, p), 1e-9);
      }
      if (distance > padding * std::sqrt(3.0)) {
        EXPECT_GT(signedDistance(grown, p), 0.0);
      }
    }
  }
}

TEST(Shape, scaledKeepsTheCentre) {
  std::mt19937 random(8);
  for (const Shape& shape : someShapes(random)) {
    const Shape twice = scaled(shape, 2.0);
    const Eigen::Vector3d center = boundingBox(shape).center();
    const Points points = randomPoints(500, 0.4, random);
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      const Eigen::Vector3d p = points.row(i).transpose();
      EXPECT_NEAR(signedDistance(twice, center + 2.0 * (p - center)), 2.0 * signedDistance(shape, p), 1e-9);
    }
  }
}

TEST(Shape, fclGeometryHasTheSameBounds) {
  std::mt19937 random(9);
  for (const Shape& shape : someShapes(random)) {
    const auto geometry = fclGeometry(shape);
    const Eigen::AlignedBox3d box = boundingBox(shape);
    EXPECT_TRUE(geometry->aabb_local.min_.isApprox(box.min(), 1e-9));
    EXPECT_TRUE(geometry->aabb_local.max_.isApprox(box.max(), 1e-9));
  }
}

TEST(ShapeInput, refusesSizesThatAreNone) {
  const Eigen::Isometry3d I = Eigen::Isometry3d::Identity();
  for (const double bad : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(Shape::box({0.1, bad, 0.1}, I), std::invalid_argument);
    EXPECT_THROW(Shape::cylinder(bad, 0.1, I), std::invalid_argument);
    EXPECT_THROW(Shape::cylinder(0.1, bad, I), std::invalid_argument);
    EXPECT_THROW(Shape::sphere(bad, I), std::invalid_argument);
    EXPECT_THROW(scaled(Shape::sphere(0.1, I), bad), std::invalid_argument);
  }
  EXPECT_THROW(padded(Shape::sphere(0.1, I), -0.01), std::invalid_argument);
  Eigen::Isometry3d broken = I;
  broken.translation().x() = kNan;
  EXPECT_THROW(Shape::sphere(0.1, broken), std::invalid_argument);
}

TEST(ShapeInput, refusesPointsWithoutAHull) {
  const Eigen::Isometry3d I = Eigen::Isometry3d::Identity();
  std::mt19937 random(10);
  EXPECT_THROW(Shape::convexHull(Points(0, 3), I), std::invalid_argument);
  EXPECT_THROW(Shape::convexHull(randomPoints(3, 1.0, random), I), std::invalid_argument);
  Points flat = randomPoints(50, 1.0, random);
  flat.col(2).setConstant(0.3);
  EXPECT_THROW(Shape::convexHull(flat, I), std::invalid_argument);
  EXPECT_THROW(Shape::convexHull(Points::Constant(20, 3, 0.1), I), std::invalid_argument);
  Points holed = randomPoints(50, 1.0, random);
  holed(7, 1) = kNan;
  EXPECT_THROW(Shape::convexHull(holed, I), std::invalid_argument);
}

}  // namespace
}  // namespace fv_robot_model
