#include "fv_robot_model/fcl_geometry.h"

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>

#include <stdexcept>
#include <vector>

namespace fv_robot_model {
namespace {

std::shared_ptr<fcl::CollisionGeometryd> convexGeometry(const Shape& shape) {
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  for (Eigen::Index v = 0; v < shape.vertices.rows(); ++v)
    vertices->push_back(shape.vertices.row(v).transpose());
  auto faces =
      std::make_shared<std::vector<int>>();  // as FCL wants it: count of corners, corners, count, ...
  for (Eigen::Index f = 0; f < shape.faces.rows(); ++f)
    faces->insert(faces->end(), {3, shape.faces(f, 0), shape.faces(f, 1), shape.faces(f, 2)});
  return std::make_shared<fcl::Convexd>(vertices, static_cast<int>(shape.faces.rows()), faces);
}

std::shared_ptr<fcl::CollisionGeometryd> geometryOf(const Shape& shape) {
  switch (shape.kind) {
    case Shape::Kind::Box:
      return std::make_shared<fcl::Boxd>(shape.dimensions);
    case Shape::Kind::Cylinder:
      return std::make_shared<fcl::Cylinderd>(shape.dimensions[0], shape.dimensions[1]);
    case Shape::Kind::Sphere:
      return std::make_shared<fcl::Sphered>(shape.dimensions[0]);
    case Shape::Kind::Convex:
      return convexGeometry(shape);
  }
  throw std::invalid_argument("unknown kind of shape");
}

}  // namespace

std::shared_ptr<const fcl::CollisionGeometryd> fclGeometry(const Shape& shape) {
  const auto geometry = geometryOf(shape);
  geometry->computeLocalAABB();  // FCL's managers and octree traversal expect it
  return geometry;
}

}  // namespace fv_robot_model
