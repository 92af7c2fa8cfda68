#include "fv_robot_model/sphere_cover.h"

#include <algorithm>
#include <cmath>

#include "internal.h"

namespace fv_robot_model {
namespace {

constexpr double kMostSpheres = 100e3;

void requireFew(double count, double max_radius_m) {
  if (!(count <= kMostSpheres))
    throw std::invalid_argument(text("a cover by balls of at most ", max_radius_m, " m needs about ", count,
                                     "; at most ", kMostSpheres, " are made"));
}

/// Cells per axis so that half a cell's diagonal is at most the radius. Cells about as wide as high cover
/// best.
Eigen::Array3i cellsPerAxis(const Eigen::Vector3d& edges, double max_radius_m) {
  const double cube = 2.0 * max_radius_m / std::sqrt(3.0);
  const Eigen::Array3d counts = (edges.array() / cube - 1e-9).ceil().max(1.0);
  requireFew(counts.prod(), max_radius_m);
  Eigen::Array3i cells = counts.cast<int>();
  // An axis that is thinner than a cube leaves the others room: coarsen them while the diagonal allows.
  for (int axis = 0; axis < 3; ++axis) {
    const auto fits = [&] {
      return 0.5 * (edges.array() / cells.cast<double>()).matrix().norm() <= max_radius_m;
    };
    while (cells[axis] > 1) {
      --cells[axis];
      if (fits()) continue;
      ++cells[axis];
      break;
    }
  }
  return cells;
}

/// Balls (shape frame) around the cells of a box; a cell that the shape does not meet is left out.
Spheres coverByCells(const Shape& shape, const Eigen::AlignedBox3d& box, double max_radius_m) {
  const Eigen::Array3i cells = cellsPerAxis(box.sizes(), max_radius_m);
  const Eigen::Vector3d edge = box.sizes().array() / cells.cast<double>();
  const double radius = 0.5 * edge.norm();
  Spheres balls;
  for (int x = 0; x < cells.x(); ++x)
    for (int y = 0; y < cells.y(); ++y)
      for (int z = 0; z < cells.z(); ++z) {
        const Eigen::Vector3d center =
            box.min() + edge.cwiseProduct(Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
        if (isWithin(shape, center, radius)) balls.push_back({center, radius});
      }
  return balls;
}

/// A row of balls along the axis of a cylinder, each through the rims of its slice.
Spheres coverBySlices(double cylinder_radius, double length, double max_radius_m) {
  const double thickest = 2.0 * std::sqrt(max_radius_m * max_radius_m - cylinder_radius * cylinder_radius);
  const double count = std::max(1.0, std::ceil(length / thickest - 1e-9));
  requireFew(count, max_radius_m);
  const double slice = length / count;
  const double radius = std::hypot(cylinder_radius, 0.5 * slice);
  Spheres balls;
  for (int i = 0; i < static_cast<int>(count); ++i)
    balls.push_back({{0.0, 0.0, (i + 0.5) * slice - 0.5 * length}, radius});
  return balls;
}

Spheres coverInShapeFrame(const Shape& shape, double max_radius_m) {
  if (shape.kind == Shape::Kind::Sphere && shape.dimensions[0] <= max_radius_m)
    return {{Eigen::Vector3d::Zero(), shape.dimensions[0]}};
  // A slice thinner than a fifth of the ball makes more balls than cells across the section would.
  if (shape.kind == Shape::Kind::Cylinder && shape.dimensions[0] <= 0.98 * max_radius_m)
    return coverBySlices(shape.dimensions[0], shape.dimensions[1], max_radius_m);
  return coverByCells(shape, boundingBox(shape), max_radius_m);
}

}  // namespace

Spheres sphereCover(const Shape& shape, double max_radius_m) {
  if (!std::isfinite(max_radius_m) || max_radius_m <= 0.0)
    throw std::invalid_argument(text("max_radius_m must be finite and positive, got ", max_radius_m));
  Spheres balls = coverInShapeFrame(shape, max_radius_m);
  for (Sphere& ball : balls) ball.center = shape.T_link_shape * ball.center;
  return balls;
}

Spheres sphereCover(const RobotModel& model, int link_index, double max_radius_m) {
  Spheres all;
  for (const Shape& shape : model.shapes(link_index)) {
    const Spheres balls = sphereCover(shape, max_radius_m);
    all.insert(all.end(), balls.begin(), balls.end());
  }
  return all;
}

}  // namespace fv_robot_model
