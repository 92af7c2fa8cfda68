#include <algorithm>
#include <cmath>
#include <limits>

#include "fv_robot_model/shape.h"

namespace fv_robot_model {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Largest plane value: the distance below the surface where negative, else a lower bound of the distance.
/// Stops at the first value above `enough`.
double planeDistance(const Shape& shape, const Vector3d& p, double enough = kInfinity) {
  double largest = -kInfinity;
  for (Eigen::Index f = 0; f < shape.planes.rows() && largest <= enough; ++f)
    largest = std::max(largest, shape.planes.row(f).head<3>().dot(p) + shape.planes(f, 3));
  return largest;
}

/// Nearest point of a segment.
Vector3d nearestOnSegment(const Vector3d& a, const Vector3d& b, const Vector3d& p) {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  if (length2 == 0.0) return a;
  return a + ab * std::clamp(ab.dot(p - a) / length2, 0.0, 1.0);
}

/// Nearest point of a triangle: the foot of the perpendicular when it lies inside, else the best of the
/// edges.
Vector3d nearestOnTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& p) {
  const Vector3d n = (b - a).cross(c - a);
  const double n2 = n.squaredNorm();
  if (n2 > 0.0) {
    const Vector3d foot = p - n * (n.dot(p - a) / n2);
    if (n.dot((b - a).cross(foot - a)) >= 0.0 && n.dot((c - b).cross(foot - b)) >= 0.0 &&
        n.dot((a - c).cross(foot - c)) >= 0.0)
      return foot;
  }
  Vector3d best = nearestOnSegment(a, b, p);
  for (const Vector3d& other : {nearestOnSegment(b, c, p), nearestOnSegment(c, a, p)})
    if ((other - p).squaredNorm() < (best - p).squaredNorm()) best = other;
  return best;
}

/// Only faces that p sees can hold the nearest point: p lies in the cone of the normals there.
Vector3d nearestOnHull(const Shape& shape, const Vector3d& p) {
  Vector3d best = p;
  double best2 = kInfinity;
  for (Eigen::Index f = 0; f < shape.planes.rows(); ++f) {
    const double height = shape.planes.row(f).head<3>().dot(p) + shape.planes(f, 3);
    if (height <= 0.0 || height * height >= best2) continue;
    const Vector3d near = nearestOnTriangle(shape.vertices.row(shape.faces(f, 0)).transpose(),
                                            shape.vertices.row(shape.faces(f, 1)).transpose(),
                                            shape.vertices.row(shape.faces(f, 2)).transpose(), p);
    const double d2 = (near - p).squaredNorm();
    if (d2 < best2) {
      best = near;
      best2 = d2;
    }
  }
  return best;
}

double boxDistance(const Shape& shape, const Vector3d& p) {
  const Vector3d excess = p.cwiseAbs() - 0.5 * shape.dimensions;
  return excess.cwiseMax(0.0).norm() + std::min(excess.maxCoeff(), 0.0);
}

double cylinderDistance(const Shape& shape, const Vector3d& p) {
  const double radial = std::hypot(p.x(), p.y()) - shape.dimensions[0];
  const double axial = std::abs(p.z()) - 0.5 * shape.dimensions[1];
  return std::hypot(std::max(radial, 0.0), std::max(axial, 0.0)) + std::min(std::max(radial, axial), 0.0);
}

}  // namespace

Vector3d closestPoint(const Shape& shape, const Vector3d& p) {
  switch (shape.kind) {
    case Shape::Kind::Box:
      return p.cwiseMin(0.5 * shape.dimensions).cwiseMax(-0.5 * shape.dimensions);
    case Shape::Kind::Cylinder: {
      const double rho = std::hypot(p.x(), p.y());
      const double shrink = rho > shape.dimensions[0] ? shape.dimensions[0] / rho : 1.0;
      const double half = 0.5 * shape.dimensions[1];
      return {p.x() * shrink, p.y() * shrink, std::clamp(p.z(), -half, half)};
    }
    case Shape::Kind::Sphere:
      return p.norm() > shape.dimensions[0] ? Vector3d(p.normalized() * shape.dimensions[0]) : p;
    case Shape::Kind::Convex:
      return nearestOnHull(shape, p);
  }
  return p;
}

double signedDistance(const Shape& shape, const Vector3d& p) {
  switch (shape.kind) {
    case Shape::Kind::Box:
      return boxDistance(shape, p);
    case Shape::Kind::Cylinder:
      return cylinderDistance(shape, p);
    case Shape::Kind::Sphere:
      return p.norm() - shape.dimensions[0];
    case Shape::Kind::Convex: {
      const double bound = planeDistance(shape, p);
      return bound <= 0.0 ? bound : (nearestOnHull(shape, p) - p).norm();
    }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

double distanceLowerBound(const Shape& shape, const Vector3d& p) {
  return shape.kind == Shape::Kind::Convex ? planeDistance(shape, p) : signedDistance(shape, p);
}

bool isWithin(const Shape& shape, const Vector3d& p, double limit_m) {
  if (shape.kind != Shape::Kind::Convex) return signedDistance(shape, p) <= limit_m;
  const double bound = planeDistance(shape, p, limit_m);
  if (bound > limit_m || bound <= 0.0) return bound <= limit_m;
  return (nearestOnHull(shape, p) - p).norm() <= limit_m;
}

}  // namespace fv_robot_model
