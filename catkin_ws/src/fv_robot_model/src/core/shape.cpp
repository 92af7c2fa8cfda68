#include "fv_robot_model/shape.h"

#include <cmath>

#include "internal.h"

namespace fv_robot_model {
namespace {

void requireSize(const char* what, double value) {
  if (!std::isfinite(value) || value <= 0.0)
    throw std::invalid_argument(text(what, " must be finite and positive, got ", value));
}

Shape primitive(Shape::Kind kind, const Eigen::Vector3d& dimensions, const Eigen::Isometry3d& T_link_shape) {
  if (!T_link_shape.matrix().allFinite()) throw std::invalid_argument("the pose of a shape is not finite");
  Shape shape;
  shape.kind = kind;
  shape.dimensions = dimensions;
  shape.T_link_shape = T_link_shape;
  return shape;
}

/// The twelve corners of the icosahedron around the unit ball.
Points icosahedronAroundUnitBall() {
  const double golden = 0.5 * (1.0 + std::sqrt(5.0));
  Points corners(12, 3);
  Eigen::Index row = 0;
  for (const double one : {-1.0, 1.0})
    for (const double phi : {-golden, golden}) {
      corners.row(row++) << 0.0, one, phi;
      corners.row(row++) << one, phi, 0.0;
      corners.row(row++) << phi, 0.0, one;
    }
  // Distance of a face from the centre, for these corners (edge 2): golden^2 / sqrt(3).
  return corners * (std::sqrt(3.0) / (golden * golden));
}

Points minkowskiSum(const Points& a, const Points& b) {
  Points sums(a.rows() * b.rows(), 3);
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    sums.middleRows(i * b.rows(), b.rows()) = b.rowwise() + a.row(i);
  return sums;
}

}  // namespace

Shape Shape::box(const Eigen::Vector3d& edges_m, const Eigen::Isometry3d& T_link_shape) {
  for (int i = 0; i < 3; ++i) requireSize("edge of a box [m]", edges_m[i]);
  return primitive(Kind::Box, edges_m, T_link_shape);
}

Shape Shape::cylinder(double radius_m, double length_m, const Eigen::Isometry3d& T_link_shape) {
  requireSize("radius of a cylinder [m]", radius_m);
  requireSize("length of a cylinder [m]", length_m);
  return primitive(Kind::Cylinder, {radius_m, length_m, 0.0}, T_link_shape);
}

Shape Shape::sphere(double radius_m, const Eigen::Isometry3d& T_link_shape) {
  requireSize("radius of a sphere [m]", radius_m);
  return primitive(Kind::Sphere, {radius_m, 0.0, 0.0}, T_link_shape);
}

Eigen::AlignedBox3d boundingBox(const Shape& shape) {
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  switch (shape.kind) {
    case Shape::Kind::Box:
      half = 0.5 * shape.dimensions;
      break;
    case Shape::Kind::Cylinder:
      half << shape.dimensions[0], shape.dimensions[0], 0.5 * shape.dimensions[1];
      break;
    case Shape::Kind::Sphere:
      half.setConstant(shape.dimensions[0]);
      break;
    case Shape::Kind::Convex:
      return {shape.vertices.colwise().minCoeff().transpose(),
              shape.vertices.colwise().maxCoeff().transpose()};
  }
  return {-half, half};
}

Sphere boundingSphere(const Shape& shape) {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0.0;
  switch (shape.kind) {
    case Shape::Kind::Box:
      radius = 0.5 * shape.dimensions.norm();
      break;
    case Shape::Kind::Cylinder:
      radius = std::hypot(shape.dimensions[0], 0.5 * shape.dimensions[1]);
      break;
    case Shape::Kind::Sphere:
      radius = shape.dimensions[0];
      break;
    case Shape::Kind::Convex:
      center = boundingBox(shape).center();
      radius = (shape.vertices.rowwise() - center.transpose()).rowwise().norm().maxCoeff();
      break;
  }
  return {shape.T_link_shape * center, radius};
}

Shape scaled(const Shape& shape, double factor) {
  requireSize("scale", factor);
  if (factor == 1.0) return shape;
  Shape result = shape;
  result.dimensions *= factor;
  if (shape.kind == Shape::Kind::Convex) {
    const Eigen::RowVector3d center = boundingBox(shape).center().transpose();
    result.vertices = ((shape.vertices.rowwise() - center) * factor).rowwise() + center;
    // n . (c + f (x - c)) + d' = f (n . x + d)  with  d' = f d - (1 - f) n . c
    const Eigen::VectorXd n_dot_c = shape.planes.leftCols<3>() * center.transpose();
    result.planes.col(3) = factor * shape.planes.col(3) - (1.0 - factor) * n_dot_c;
  }
  return result;
}

Shape padded(const Shape& shape, double padding_m) {
  if (!std::isfinite(padding_m) || padding_m < 0.0)
    throw std::invalid_argument(text("padding [m] must be finite and not negative, got ", padding_m));
  if (padding_m == 0.0) return shape;
  Shape result = shape;
  switch (shape.kind) {
    case Shape::Kind::Box:
      result.dimensions.array() += 2.0 * padding_m;
      break;
    case Shape::Kind::Cylinder:
      result.dimensions += Eigen::Vector3d(padding_m, 2.0 * padding_m, 0.0);
      break;
    case Shape::Kind::Sphere:
      result.dimensions[0] += padding_m;
      break;
    case Shape::Kind::Convex:
      return Shape::convexHull(minkowskiSum(shape.vertices, padding_m * icosahedronAroundUnitBall()),
                               shape.T_link_shape);
  }
  return result;
}

}  // namespace fv_robot_model
