#include "capability_map/direction_lookup.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace capability_map {

namespace {

constexpr int kSide = 64;  // texels along each edge of the octahedral square

double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// The unit vector of a point of the octahedral square [-1, 1]^2.
Eigen::Vector3d fromSquare(double u, double v) {
  Eigen::Vector3d d(u, v, 1.0 - std::abs(u) - std::abs(v));
  if (d.z() < 0.0) {  // the lower half is folded over the diagonals
    d.x() = (1.0 - std::abs(v)) * (u < 0.0 ? -1.0 : 1.0);
    d.y() = (1.0 - std::abs(u)) * (v < 0.0 ? -1.0 : 1.0);
  }
  return d.normalized();
}

int squareIndex(double u) { return std::clamp(static_cast<int>((u + 1.0) * (0.5 * kSide)), 0, kSide - 1); }

}  // namespace

DirectionLookup::DirectionLookup(const Points& directions, double reach_rad) : reach_rad_(reach_rad) {
  if (directions.rows() == 0) throw std::invalid_argument("a lookup needs at least one direction");
  if (!(reach_rad > 0.0 && reach_rad < M_PI)) {
    throw std::invalid_argument("reach_rad must be in (0, pi), not " + std::to_string(reach_rad));
  }
  for (Eigen::Index i = 0; i < directions.rows(); ++i) {
    if (!(std::abs(directions.row(i).norm() - 1.0) < 1e-6)) {
      throw std::invalid_argument("direction " + std::to_string(i) + " is no unit vector");
    }
    directions_.push_back(directions.row(i).transpose().normalized());
  }
  near_.start.push_back(0);
  around_.start.push_back(0);
  for (int texel = 0; texel < kSide * kSide; ++texel) listTexel(texel);
}

void DirectionLookup::listTexel(int texel) {
  const double step = 2.0 / kSide;
  const double u = -1.0 + step * (texel / kSide);
  const double v = -1.0 + step * (texel % kSide);
  const Eigen::Vector3d middle = fromSquare(u + 0.5 * step, v + 0.5 * step);
  double size = 0.0;
  for (const double du : {0.0, step}) {
    for (const double dv : {0.0, step})
      size = std::max(size, angleBetween(middle, fromSquare(u + du, v + dv)));
  }
  size *= 1.05;  // edges of a texel bend a little beyond its corners
  std::vector<double> angles;
  for (const Eigen::Vector3d& d : directions_) angles.push_back(angleBetween(middle, d));
  const double closest = *std::min_element(angles.begin(), angles.end());
  for (size_t i = 0; i < directions_.size(); ++i) {
    if (angles[i] <= closest + 2.0 * size) near_.item.push_back(static_cast<int32_t>(i));
    if (angles[i] <= reach_rad_ + size) around_.item.push_back(static_cast<int32_t>(i));
  }
  near_.start.push_back(static_cast<int32_t>(near_.item.size()));
  around_.start.push_back(static_cast<int32_t>(around_.item.size()));
}

size_t DirectionLookup::texelAt(const Eigen::Vector3d& d) const {
  const double scale = 1.0 / (std::abs(d.x()) + std::abs(d.y()) + std::abs(d.z()));
  double u = d.x() * scale;
  double v = d.y() * scale;
  if (d.z() < 0.0) {
    const double folded = (1.0 - std::abs(v)) * (u < 0.0 ? -1.0 : 1.0);
    v = (1.0 - std::abs(u)) * (v < 0.0 ? -1.0 : 1.0);
    u = folded;
  }
  return static_cast<size_t>(squareIndex(u) * kSide + squareIndex(v));
}

int DirectionLookup::nearest(const Eigen::Vector3d& d) const {
  int best = 0;
  double largest = -2.0;
  for (const int32_t candidate : near_.of(texelAt(d))) {
    const double cosine = d.dot(directions_[static_cast<size_t>(candidate)]);
    if (cosine > largest) {
      largest = cosine;
      best = candidate;
    }
  }
  return best;
}

DirectionLookup::Range DirectionLookup::around(const Eigen::Vector3d& d) const {
  return around_.of(texelAt(d));
}

}  // namespace capability_map
