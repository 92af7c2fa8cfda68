#include "capability_map/seed_lookup.h"

#include <Eigen/Geometry>
#include <cmath>

#include "view_direction.h"

namespace capability_map {

SeedLookup::SeedLookup(const SphereGrid& grid, const Points& view_directions, SphereBits bits)
    : grid_(grid), bits_(std::move(bits)) {
  checkBits(grid, view_directions.rows(), bits_);
  for (Eigen::Index k = 0; k < view_directions.rows(); ++k)
    directions_.push_back(view_directions.row(k).transpose().normalized());
  const auto rows = static_cast<int32_t>(bits_.words.size() / static_cast<size_t>(bits_.words_per_row));
  int64_t points = 0;
  for (int32_t row = 0; row < rows; ++row) {
    first_point_.push_back(points);
    for (int k = 0; k < static_cast<int>(directions_.size()); ++k) points += bits_.valid(row, k) ? 1 : 0;
  }
}

SeedLookup::Seed SeedLookup::nearest(const Eigen::Vector3d& position,
                                     const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d d = viewDirection(position, direction);
  const int64_t cell = grid_.cellAt(position + grid_.radius_m * d);
  const int32_t row = cell < 0 ? -1 : bits_.row_of_cell[static_cast<size_t>(cell)];
  if (row < 0) return {};
  Seed best;
  double largest = -2.0;
  int64_t point = first_point_[static_cast<size_t>(row)];
  for (int k = 0; k < static_cast<int>(directions_.size()); ++k) {
    if (!bits_.valid(row, k)) continue;
    const double cosine = d.dot(directions_[static_cast<size_t>(k)]);
    if (cosine > largest) {
      largest = cosine;
      best.point = point;
    }
    ++point;
  }
  best.angle_rad = best.point < 0 ? 0.0 : std::acos(std::min(1.0, std::max(-1.0, largest)));
  return best;
}

}  // namespace capability_map
