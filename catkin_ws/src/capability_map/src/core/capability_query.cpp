#include "capability_map/capability_query.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "view_direction.h"

namespace capability_map {

namespace {

constexpr size_t kMostBytes = size_t{1} << 29;  // far above any arm's map

/// Angle over which directions are blended: beyond that of the nearest three, for single bits are coarse.
double blendReach(Eigen::Index directions) {
  const double spacing = std::sqrt(4.0 * M_PI / static_cast<double>(std::max<Eigen::Index>(1, directions)));
  return std::min(1.5 * spacing, 0.9 * M_PI);
}

}  // namespace

void checkBits(const SphereGrid& grid, Eigen::Index directions, const SphereBits& bits) {
  if (static_cast<int64_t>(bits.row_of_cell.size()) != grid.cellCount()) {
    throw std::invalid_argument("row_of_cell has " + std::to_string(bits.row_of_cell.size()) +
                                " entries, the grid " + std::to_string(grid.cellCount()) + " cells");
  }
  if (bits.words_per_row != (directions + 63) / 64 || bits.words_per_row == 0 ||
      bits.words.size() % static_cast<size_t>(bits.words_per_row) != 0) {
    throw std::invalid_argument("bits do not fit " + std::to_string(directions) + " directions");
  }
  const auto rows = static_cast<int64_t>(bits.words.size()) / bits.words_per_row;
  for (const int32_t row : bits.row_of_cell) {
    if (row < -1 || row >= rows) throw std::invalid_argument("row_of_cell names row " + std::to_string(row));
  }
}

CapabilityQuery::CapabilityQuery(const SphereGrid& grid, const Points& view_directions,
                                 const SphereBits& bits, const ArmPivots& pivots)
    : grid_(grid),
      lookup_(view_directions, blendReach(view_directions.rows())),
      pivots_(pivots),
      least_cosine_(std::cos(lookup_.reachRad())) {
  checkBits(grid, view_directions.rows(), bits);
  if (!std::isfinite(pivots.wrist_m) || !pivots.shoulder.allFinite()) {
    throw std::invalid_argument("the arm's pivots must be finite");
  }
  // One byte more than the bits need: two bytes are read at a time.
  column_bytes_ = (static_cast<size_t>(grid.size.z()) + 2 + 7) / 8 + 1;
  plane_bytes_ = column_bytes_ * (static_cast<size_t>(grid.size.y()) + 2);
  volume_bytes_ = plane_bytes_ * (static_cast<size_t>(grid.size.x()) + 2);
  if (volume_bytes_ > kMostBytes / static_cast<size_t>(view_directions.rows())) {
    throw std::invalid_argument(std::to_string(grid.cellCount()) + " cells with " +
                                std::to_string(view_directions.rows()) +
                                " directions need more than 512 MiB");
  }
  volumes_.assign(volume_bytes_ * static_cast<size_t>(view_directions.rows()), 0);
  for (int64_t cell = 0; cell < grid.cellCount(); ++cell) {
    const int32_t row = bits.row_of_cell[static_cast<size_t>(cell)];
    if (row < 0) continue;
    const Eigen::Vector3i at = grid.place(cell);
    const auto z = static_cast<size_t>(at.z() + 1);
    const size_t column = static_cast<size_t>(at.x() + 1) * plane_bytes_ +
                          static_cast<size_t>(at.y() + 1) * column_bytes_ + (z >> 3);
    for (int k = 0; k < static_cast<int>(view_directions.rows()); ++k) {
      if (bits.valid(row, k)) {
        volumes_[static_cast<size_t>(k) * volume_bytes_ + column] |= static_cast<uint8_t>(1U << (z & 7));
      }
    }
  }
}

double CapabilityQuery::cellBlend(const Eigen::Vector3d& center, int direction) const {
  const Eigen::Array3d place =
      (center - grid_.origin).array() / (2.0 * grid_.radius_m) + 0.5;  // counted from the empty layer
  const Eigen::Array3d floor = place.floor();
  const bool near = (floor >= 0.0).all() && (floor <= grid_.size.cast<double>().array()).all();
  if (!near) return 0.0;
  const Eigen::Array3d high = place - floor;
  const auto z = static_cast<size_t>(floor.z());
  const uint8_t* column = volumes_.data() + static_cast<size_t>(direction) * volume_bytes_ +
                          static_cast<size_t>(floor.x()) * plane_bytes_ +
                          static_cast<size_t>(floor.y()) * column_bytes_ + (z >> 3);
  const std::array<double, 4> of_pair{0.0, 1.0 - high.z(), high.z(),
                                      1.0};  // by the bits of a cell and the next
  const auto along = [&](const uint8_t* bytes) {
    uint16_t word = 0;
    std::memcpy(&word, bytes, sizeof(word));
    return of_pair[(word >> (z & 7)) & 3U];
  };
  const double low_x = (1.0 - high.y()) * along(column) + high.y() * along(column + column_bytes_);
  column += plane_bytes_;
  const double high_x = (1.0 - high.y()) * along(column) + high.y() * along(column + column_bytes_);
  return (1.0 - high.x()) * low_x + high.x() * high_x;
}

float CapabilityQuery::interpolated(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d d = viewDirection(position, direction);
  const double r = grid_.radius_m;
  const Eigen::Vector3d wrist = position - pivots_.wrist_m * d;
  const Eigen::Vector3d arm = position - pivots_.shoulder;
  const double arm_along = arm.dot(d);
  double sum = 0.0;
  double total = 0.0;
  for (const int32_t k : lookup_.around(d)) {
    const Eigen::Vector3d& stored = lookup_.directions()[static_cast<size_t>(k)];
    const double cosine = d.dot(stored);
    const double weight = cosine - least_cosine_;
    if (weight <= 0.0) continue;
    total += weight;
    // The rotation that takes d to the stored direction, applied to the arm: c x + v x x + v (v . x) / (1 +
    // c) with v = d x stored, the product taken apart.
    const Eigen::Vector3d v = d.cross(stored);
    const Eigen::Vector3d turned =
        cosine * arm + stored * arm_along - d * arm.dot(stored) + v * (v.dot(arm) / (1.0 + cosine));
    sum += weight * (cellBlend(wrist + (pivots_.wrist_m + r) * stored, k) +
                     cellBlend(pivots_.shoulder + turned + r * stored, k));
  }
  return total > 0.0 ? static_cast<float>(0.5 * sum / total) : nearest(position, direction);
}

float CapabilityQuery::nearest(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d d = viewDirection(position, direction);
  const int64_t cell = grid_.cellAt(position + grid_.radius_m * d);
  if (cell < 0) return 0.0F;
  return bit(grid_.place(cell), lookup_.nearest(d)) ? 1.0F : 0.0F;
}

bool CapabilityQuery::bit(const Eigen::Vector3i& cell, int direction) const {
  const auto z = static_cast<size_t>(cell.z() + 1);
  const size_t at = static_cast<size_t>(direction) * volume_bytes_ +
                    static_cast<size_t>(cell.x() + 1) * plane_bytes_ +
                    static_cast<size_t>(cell.y() + 1) * column_bytes_ + (z >> 3);
  return ((volumes_[at] >> (z & 7)) & 1U) != 0U;
}

}  // namespace capability_map
