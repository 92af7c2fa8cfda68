#include "capability_map/sphere_grid.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace capability_map {

Points spiralPoints(int n) {
  if (n < 4) throw std::invalid_argument("a sphere needs at least 4 points, not " + std::to_string(n));
  Points points(n, 3);
  double azimuth = 0.0;
  for (int k = 0; k < n; ++k) {
    const double height = -1.0 + 2.0 * k / (n - 1.0);
    const double across = std::sqrt(std::max(0.0, 1.0 - height * height));
    const bool pole = k == 0 || k == n - 1;
    azimuth =
        pole ? 0.0 : std::fmod(azimuth + 3.6 / (std::sqrt(static_cast<double>(n)) * across), 2.0 * M_PI);
    points.row(k) << across * std::cos(azimuth), across * std::sin(azimuth), height;
  }
  return points;
}

int64_t SphereGrid::cellAt(const Eigen::Vector3d& p) const {
  const Eigen::Array3d index = ((p - origin) / (2.0 * radius_m)).array().floor();
  const bool inside = (index >= 0.0).all() && (index < size.cast<double>().array()).all();
  if (!inside) return -1;
  return (static_cast<int64_t>(index.x()) * size.y() + static_cast<int64_t>(index.y())) * size.z() +
         static_cast<int64_t>(index.z());
}

}  // namespace capability_map
