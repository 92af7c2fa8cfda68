#include "capability_map/capability_query.h"

#include <cmath>
#include <stdexcept>

namespace capability_map {

CapabilityQuery::CapabilityQuery(SphereGrid grid, DirectionLookup lookup, const Points& view_directions,
                                 SphereBits bits, double pivot_m)
    : grid_(grid), lookup_(std::move(lookup)), bits_(std::move(bits)), pivot_m_(pivot_m) {
  const auto directions = static_cast<int>(view_directions.rows());
  if (static_cast<int64_t>(bits_.row_of_cell.size()) != grid_.cellCount()) {
    throw std::invalid_argument("row_of_cell has " + std::to_string(bits_.row_of_cell.size()) +
                                " entries, the grid " + std::to_string(grid_.cellCount()) + " cells");
  }
  if (bits_.words_per_row != (directions + 63) / 64 || bits_.words_per_row == 0 ||
      bits_.words.size() % static_cast<size_t>(bits_.words_per_row) != 0) {
    throw std::invalid_argument("bits do not fit " + std::to_string(directions) + " directions");
  }
  const auto rows = static_cast<int64_t>(bits_.words.size()) / bits_.words_per_row;
  for (const int32_t row : bits_.row_of_cell) {
    if (row < -1 || row >= rows) throw std::invalid_argument("row_of_cell names row " + std::to_string(row));
  }
  if (!std::isfinite(pivot_m)) throw std::invalid_argument("pivot_m must be finite");
  for (int i = 0; i < directions; ++i) directions_.push_back(view_directions.row(i).transpose());
}

double CapabilityQuery::cellBlend(const Eigen::Vector3d& center, int direction) const {
  const Eigen::Vector3d place =
      (center - grid_.origin) / (2.0 * grid_.radius_m) - Eigen::Vector3d::Constant(0.5);
  const Eigen::Vector3d floor = place.array().floor();
  const bool near =
      (floor.array() >= -1.0).all() && (floor.array() < grid_.size.cast<double>().array()).all();
  if (!near) return 0.0;
  const Eigen::Vector3i low = floor.cast<int>();
  const Eigen::Vector3d high_share = place - floor;
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = low.x() + (corner & 1);
    const int y = low.y() + ((corner >> 1) & 1);
    const int z = low.z() + (corner >> 2);
    if (x < 0 || y < 0 || z < 0 || x >= grid_.size.x() || y >= grid_.size.y() || z >= grid_.size.z())
      continue;
    const int64_t cell = (int64_t{x} * grid_.size.y() + y) * grid_.size.z() + z;
    const int32_t row = bits_.row_of_cell[static_cast<size_t>(cell)];
    if (row < 0 || !bits_.valid(row, direction)) continue;
    sum += ((corner & 1) ? high_share.x() : 1.0 - high_share.x()) *
           ((corner & 2) ? high_share.y() : 1.0 - high_share.y()) *
           ((corner & 4) ? high_share.z() : 1.0 - high_share.z());
  }
  return sum;
}

float CapabilityQuery::interpolated(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const {
  const double norm = direction.norm();
  if (!(norm > 1e-9) || !std::isfinite(norm) || !position.allFinite()) return 0.0F;
  const Eigen::Vector3d d = direction / norm;
  const DirectionLookup::Blend blend = lookup_.blend(d);
  const Eigen::Vector3d pivot = position - pivot_m_ * d;
  double sum = 0.0;
  for (size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& stored = directions_[static_cast<size_t>(blend.index[k])];
    sum += blend.weight[k] * cellBlend(pivot + (pivot_m_ + grid_.radius_m) * stored, blend.index[k]);
  }
  return static_cast<float>(sum);
}

float CapabilityQuery::nearest(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const {
  const double norm = direction.norm();
  if (!(norm > 1e-9) || !std::isfinite(norm) || !position.allFinite()) return 0.0F;
  const Eigen::Vector3d d = direction / norm;
  const int64_t cell = grid_.cellAt(position + grid_.radius_m * d);
  if (cell < 0) return 0.0F;
  const int32_t row = bits_.row_of_cell[static_cast<size_t>(cell)];
  return row >= 0 && bits_.valid(row, lookup_.nearest(d)) ? 1.0F : 0.0F;
}

}  // namespace capability_map
