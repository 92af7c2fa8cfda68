#include "distance_field.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace ompl_planner {
namespace {

/// 4 g(d)^2 for d = 0 .. reach: the squared distance along one axis from a centre to a voxel d away.
std::vector<std::int16_t> axisCosts(int reach) {
  std::vector<std::int16_t> cost(static_cast<std::size_t>(reach) + 1, 0);
  for (int d = 1; d <= reach; ++d)
    cost[static_cast<std::size_t>(d)] = static_cast<std::int16_t>((2 * d - 1) * (2 * d - 1));
  return cost;
}

std::int16_t leastOf(const std::int16_t* values, std::size_t count) {
  std::int16_t least = values[0];
  for (std::size_t i = 1; i < count; ++i) least = values[i] < least ? values[i] : least;
  return least;
}

std::int16_t mostOf(const std::int16_t* values, std::size_t count) {
  std::int16_t most = values[0];
  for (std::size_t i = 1; i < count; ++i) most = values[i] > most ? values[i] : most;
  return most;
}

/// out = min(out, in + cost), element by element.
void lower(std::int16_t* out, const std::int16_t* in, std::int16_t cost, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto sum = static_cast<std::int16_t>(in[i] + cost);
    out[i] = sum < out[i] ? sum : out[i];
  }
}

}  // namespace

DistanceField::DistanceField(const VoxelGrid& grid, const Eigen::AlignedBox3d& region_m, double cap_m)
    : resolution_(grid.resolution()), inverse_resolution_(1.0 / grid.resolution()) {
  constexpr int kMaxReach = 40;  // squares must fit 16 bits in all sums
  if (!(cap_m > 0.0)) throw std::invalid_argument("distance field: the cap must be positive");
  const VoxelIndex low = grid.indexOf(region_m.min()).cwiseMax(grid.origin());
  const VoxelIndex high =
      grid.indexOf(region_m.max()).cwiseMin(grid.origin() + grid.size() - VoxelIndex::Ones());
  if ((high.array() < low.array()).any())
    throw std::invalid_argument("distance field: the region misses the grid");
  corner_ = low.cast<double>();
  size_ = high - low + Eigen::Vector3i::Ones();
  const int reach = std::min(kMaxReach, static_cast<int>(std::ceil(cap_m * inverse_resolution_)));
  const auto cost = axisCosts(reach);
  const auto beyond =
      static_cast<std::int16_t>((2 * reach + 1) * (2 * reach + 1));  // nothing nearer than reach
  squares_.assign(static_cast<std::size_t>(size_.cast<long>().prod()), beyond);
  std::size_t at = 0;
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      std::size_t from = grid.offset({x, y, low.z()});
      for (int z = low.z(); z <= high.z(); ++z, ++from, ++at) {
        if (grid.atOffset(from) != Voxel::Free) squares_[at] = 0;
      }
    }
  }
  sweepColumns(cost);
  sweepRows(1, cost);
  sweepRows(0, cost);
  lowerToBorder(reach);
  roots_.resize(static_cast<std::size_t>(beyond) + 1);
  for (std::size_t i = 0; i < roots_.size(); ++i) roots_[i] = 0.5F * std::sqrt(static_cast<float>(i));
}

/// Along z, where neighbours lie side by side. Obstacles are 0 and all else is `beyond`, so that counting
/// steps from the nearest obstacle, once upwards and once downwards, gives this axis' distances.
void DistanceField::sweepColumns(const std::vector<std::int16_t>& cost) {
  const auto nz = static_cast<std::size_t>(size_.z());
  const std::size_t reach = cost.size() - 1;
  std::vector<std::int16_t> squares(cost);  // by steps
  squares.push_back(static_cast<std::int16_t>((2 * reach + 1) * (2 * reach + 1)));
  std::vector<std::size_t> steps(nz);
  for (std::size_t begin = 0; begin < squares_.size(); begin += nz) {
    std::int16_t* column = squares_.data() + begin;
    if (std::all_of(column, column + nz, [column](std::int16_t value) { return value == column[0]; }))
      continue;
    std::size_t since = reach + 1;
    for (std::size_t z = 0; z < nz; ++z) {
      since = column[z] == 0 ? 0 : std::min(since + 1, reach + 1);
      steps[z] = since;
    }
    since = reach + 1;
    for (std::size_t z = nz; z-- > 0;) {
      since = column[z] == 0 ? 0 : std::min(since + 1, reach + 1);
      column[z] = squares[std::min(steps[z], since)];
    }
  }
}

/// Along x or y: whole z rows are combined at once. A row that holds no distance yet lowers nothing, and
/// further rows lower nothing once all of a row is nearer than they are: most pairs of rows are skipped.
void DistanceField::sweepRows(Eigen::Index axis, const std::vector<std::int16_t>& cost) {
  const auto nx = static_cast<std::size_t>(size_.x());
  const auto ny = static_cast<std::size_t>(size_.y());
  const auto nz = static_cast<std::size_t>(size_.z());
  const std::size_t stride = axis == 0 ? ny * nz : nz;
  const std::size_t length = axis == 0 ? nx : ny;
  const std::size_t lines = axis == 0 ? ny : nx;
  const std::size_t line_stride = axis == 0 ? nz : ny * nz;
  std::vector<std::int16_t> before(length * nz);
  std::vector<std::int16_t> least(length);  // of each row before
  for (std::size_t line = 0; line < lines; ++line) {
    std::int16_t* first = squares_.data() + line * line_stride;
    for (std::size_t i = 0; i < length; ++i) {
      std::copy_n(first + i * stride, nz, before.data() + i * nz);
      least[i] = leastOf(before.data() + i * nz, nz);
    }
    for (std::size_t i = 0; i < length; ++i) {
      std::int16_t* out = first + i * stride;
      int most = mostOf(out, nz);
      for (std::size_t d = 1; d < cost.size() && cost[d] < most; ++d) {
        for (const std::size_t j : {i - d, i + d}) {  // i - d wraps around below 0
          if (j >= length || least[j] + cost[d] >= most) continue;
          lower(out, before.data() + j * nz, cost[d], nz);
        }
        most = mostOf(out, nz);
      }
    }
  }
}

/// What lies outside of the region is not known here: no bound may reach beyond its border.
void DistanceField::lowerToBorder(int reach) {
  std::size_t at = 0;
  for (int x = 0; x < size_.x(); ++x) {
    for (int y = 0; y < size_.y(); ++y) {
      const int side = std::min({x, y, size_.x() - 1 - x, size_.y() - 1 - y});
      for (int z = 0; z < size_.z(); ++z, ++at) {
        const int inside = std::min({side, z, size_.z() - 1 - z, reach});
        squares_[at] = std::min(squares_[at], static_cast<std::int16_t>((2 * inside + 1) * (2 * inside + 1)));
      }
    }
  }
}

}  // namespace ompl_planner
