/// Convex collision shapes: distances, scaling, padding.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "fv_robot_model/types.h"

namespace fv_robot_model {

/// Ball in the frame of whoever holds it [m].
struct Sphere {
  Eigen::Vector3d center{Eigen::Vector3d::Zero()};
  double radius{0.0};
};
using Spheres = std::vector<Sphere>;

/// One convex collision body of a link. A mesh is taken as its convex hull, which is conservative.
struct Shape {
  enum class Kind { Box, Cylinder, Sphere, Convex };

  Kind kind{Kind::Sphere};
  /// [m] Box: full edge lengths. Cylinder: radius, length, 0; its axis is z. Sphere: radius, 0, 0. Convex:
  /// unused.
  Eigen::Vector3d dimensions{Eigen::Vector3d::Zero()};
  /// Convex only: (V, 3) corners of the hull, shape frame [m].
  Points vertices;
  /// Convex only: (F, 3) rows of `vertices`, counter-clockwise seen from outside.
  Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor> faces;
  /// Convex only: (F, 4) outward unit normal and offset of each face: n . p + d <= 0 inside.
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> planes;
  /// Takes shape-frame points to the frame of the link.
  Eigen::Isometry3d T_link_shape{Eigen::Isometry3d::Identity()};

  /// @throws std::invalid_argument for sizes that are not finite and positive.
  static Shape box(const Eigen::Vector3d& edges_m, const Eigen::Isometry3d& T_link_shape);
  static Shape cylinder(double radius_m, double length_m, const Eigen::Isometry3d& T_link_shape);
  static Shape sphere(double radius_m, const Eigen::Isometry3d& T_link_shape);
  /// Convex hull (Qhull) of (N, 3) points given in the shape frame.
  /// @throws std::invalid_argument for fewer than 4 points, points that are not finite or lie in one plane.
  static Shape convexHull(const Eigen::Ref<const Points>& points, const Eigen::Isometry3d& T_link_shape);
};

/// The point of the (closed, solid) shape that is nearest to p; p itself when it lies inside. Shape frame
/// [m].
Eigen::Vector3d closestPoint(const Shape& shape, const Eigen::Vector3d& p_shape);

/// Euclidean distance from p (shape frame) to the surface [m], negative inside. Exact for every kind.
double signedDistance(const Shape& shape, const Eigen::Vector3d& p_shape);

/// At most signedDistance(shape, p), and the same inside; cheaper outside of hulls (their planes only), where
/// it is off beside edges and corners. Changes no faster than p moves.
double distanceLowerBound(const Shape& shape, const Eigen::Vector3d& p_shape);

/// Same as signedDistance(shape, p) <= limit_m, with the costly cases (hulls) decided early.
bool isWithin(const Shape& shape, const Eigen::Vector3d& p_shape, double limit_m);

/// Ball that contains the shape, link frame; the smallest one for box, cylinder and sphere.
Sphere boundingSphere(const Shape& shape);

/// Box (centre and half edges, shape frame [m]) that contains the shape.
Eigen::AlignedBox3d boundingBox(const Shape& shape);

/// The shape scaled about the centre of its bounding box.
/// @throws std::invalid_argument unless factor is finite and positive.
Shape scaled(const Shape& shape, double factor);

/// A shape of the same kind that contains every point within padding_m of `shape` (corners stay sharp; a hull
/// is swept with an icosahedron about the ball, so it may exceed the padding by a quarter).
/// @throws std::invalid_argument unless padding_m is finite and not negative.
Shape padded(const Shape& shape, double padding_m);

}  // namespace fv_robot_model
