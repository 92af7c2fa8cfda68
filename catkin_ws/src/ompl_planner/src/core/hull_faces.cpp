#include "hull_faces.h"

#include <numeric>
#include <stdexcept>

namespace ompl_planner {
namespace {

constexpr double kEdge = 0.02;      // [m] of a cell: smaller ones would list hardly fewer faces
constexpr double kMargin = 0.08;    // [m] about the hull: what a block of four 2 cm voxels reaches
constexpr int kBlock = 4;           // cells per axis that are looked at together first
constexpr double kRounding = 1e-9;  // [m]

}  // namespace

HullFaces::HullFaces(const fv_robot_model::Shape& hull) : planes_(hull.planes) {
  if (hull.kind != fv_robot_model::Shape::Kind::Convex)
    throw std::invalid_argument("hull faces: the shape is no hull");
  const Eigen::AlignedBox3d box = fv_robot_model::boundingBox(hull);
  corner_ = box.min() - Eigen::Vector3d::Constant(kMargin);
  size_ = ((box.sizes().array() + 2.0 * kMargin) / kEdge).ceil().cast<int>();
  all_.resize(static_cast<std::size_t>(planes_.rows()));
  std::iota(all_.begin(), all_.end(), 0U);
  listFaces();
}

/// Block by block, so that most faces are dismissed for many cells at once.
void HullFaces::listFaces() {
  std::vector<Faces> by_cell(static_cast<std::size_t>(size_.cast<long>().prod()));
  const auto boxOf = [&](const Eigen::Vector3i& first, const Eigen::Vector3i& end) {
    return Eigen::AlignedBox3d(corner_ + kEdge * first.cast<double>(), corner_ + kEdge * end.cast<double>());
  };
  const auto fillBlock = [&](const Eigen::Vector3i& first) {
    const Eigen::Vector3i end = (first.array() + kBlock).min(size_.array());
    const Faces candidates = reaching(all_, boxOf(first, end));
    for (int x = first.x(); x < end.x(); ++x)
      for (int y = first.y(); y < end.y(); ++y)
        for (int z = first.z(); z < end.z(); ++z) {
          const Eigen::Vector3i cell(x, y, z);
          by_cell[static_cast<std::size_t>((x * size_.y() + y) * size_.z() + z)] =
              reaching(candidates, boxOf(cell, cell + Eigen::Vector3i::Ones()));
        }
  };
  for (int x = 0; x < size_.x(); x += kBlock)
    for (int y = 0; y < size_.y(); y += kBlock)
      for (int z = 0; z < size_.z(); z += kBlock) fillBlock({x, y, z});
  for (const Faces& faces : by_cell) {
    begins_.push_back(static_cast<std::uint32_t>(faces_.size()));
    faces_.insert(faces_.end(), faces.begin(), faces.end());
  }
  begins_.push_back(static_cast<std::uint32_t>(faces_.size()));
}

/// Those of the faces that are the furthest one somewhere in the box: in its middle one is, and another
/// overtakes it at a corner if anywhere. One face where all of the box is inside the hull.
HullFaces::Faces HullFaces::reaching(const Faces& faces, const Eigen::AlignedBox3d& box) const {
  const Eigen::Vector3d center = box.center();
  const Eigen::Vector3d half = 0.5 * box.sizes();
  std::vector<double> heights;
  heights.reserve(faces.size());
  std::size_t best = 0;
  bool inside = true;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    heights.push_back(height(faces[i], center));
    if (heights[i] > heights[best]) best = i;
    inside = inside && heights[i] + half.dot(planes_.row(faces[i]).head<3>().cwiseAbs()) < -kRounding;
  }
  if (inside) return {faces[best]};
  const Eigen::RowVector3d normal = planes_.row(faces[best]).head<3>();
  Faces kept;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const double gain = half.dot((planes_.row(faces[i]).head<3>() - normal).cwiseAbs());
    if (heights[i] + gain >= heights[best] - kRounding) kept.push_back(faces[i]);
  }
  return kept;
}

HullFaces::Furthest HullFaces::among(const std::uint32_t* begin, const std::uint32_t* end,
                                     const Eigen::Vector3d& p_shape) const {
  std::uint32_t best = *begin;
  double most = height(best, p_shape);
  for (const std::uint32_t* face = begin + 1; face != end; ++face) {
    const double value = height(*face, p_shape);
    if (value <= most) continue;
    most = value;
    best = *face;
  }
  return {most, planes_.row(best).head<3>().transpose()};
}

HullFaces::Furthest HullFaces::furthest(const Eigen::Vector3d& p_shape) const {
  const Eigen::Array3i cell = ((p_shape - corner_) / kEdge).array().floor().cast<int>();
  if ((cell < 0).any() || (cell >= size_.array()).any())
    return among(all_.data(), all_.data() + all_.size(), p_shape);
  const auto index = static_cast<std::size_t>((cell.x() * size_.y() + cell.y()) * size_.z() + cell.z());
  return among(faces_.data() + begins_[index], faces_.data() + begins_[index + 1], p_shape);
}

}  // namespace ompl_planner
