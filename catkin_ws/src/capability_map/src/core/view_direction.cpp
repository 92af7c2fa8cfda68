#include "view_direction.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace capability_map {

namespace {

[[noreturn]] void refuse(const char* what, const Eigen::Vector3d& v, const char* valid) {
  std::ostringstream text;
  text << what << " (" << v.x() << ", " << v.y() << ", " << v.z() << ") is not valid: " << valid;
  throw std::invalid_argument(text.str());
}

}  // namespace

Eigen::Vector3d viewDirection(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) {
  constexpr double kSafe = 1e100;  // within 1/kSafe..kSafe squares neither vanish nor overflow
  if (!position.allFinite()) refuse("position", position, "finite numbers of metres");
  const double norm = direction.norm();
  if (norm > 1.0 / kSafe && norm < kSafe) return direction / norm;
  const double largest = direction.cwiseAbs().maxCoeff();
  if (!direction.allFinite() || largest == 0.0) {
    refuse("direction", direction, "three finite numbers, not all 0");
  }
  return (direction / largest).normalized();
}

}  // namespace capability_map
