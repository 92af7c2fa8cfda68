#pragma once
#include <octomap/octomap_types.h>

#include <cmath>
#include <limits>

#include "fv_exploration/grid.h"
#include "grid_walk.h"

namespace fv {

/// Conversions and the start of a ray with the roundings of OcTreeBaseImpl.
class RayMaker {
 public:
  explicit RayMaker(double resolution_m) : resolution_(resolution_m), factor_(1. / resolution_m) {}

  /// The voxel of a coordinate; false beyond OctoMap's keys.
  bool voxel(const octomap::point3d& p, Voxel& v) const {
    for (int i = 0; i < 3; ++i) {
      const double scaled = factor_ * p(i);
      if (!(scaled >= -kKeyOffset && scaled < kKeyOffset)) return false;
      v[i] = floorInt(scaled);
    }
    return true;
  }

  /// A ray on its way from voxel to voxel.
  struct Ray {
    Voxel at, end;
    int step[3];
    double t_max[3], t_delta[3];
    double length;
  };

  /// @return false when there is nothing to walk: both ends in one voxel, one beyond the keys, or so near to
  /// each other that their distance is 0 in float.
  bool start(const octomap::point3d& origin, const octomap::point3d& end, Ray& ray) const {
    if (!voxel(origin, ray.at) || !voxel(end, ray.end) || ray.at == ray.end) return false;
    octomap::point3d direction = end - origin;
    const float length = static_cast<float>(direction.norm());
    if (!(length > 0)) return false;
    direction /= length;
    ray.length = length;
    for (int i = 0; i < 3; ++i) {
      ray.step[i] = direction(i) > 0 ? 1 : direction(i) < 0 ? -1 : 0;
      ray.t_max[i] = ray.t_delta[i] = std::numeric_limits<double>::max();
      if (ray.step[i] == 0) continue;
      double border = (double(ray.at[i]) + 0.5) * resolution_;
      border += static_cast<float>(ray.step[i] * resolution_ * 0.5);
      ray.t_max[i] = (border - origin(i)) / direction(i);
      ray.t_delta[i] = resolution_ / std::fabs(direction(i));
    }
    return true;
  }

 private:
  double resolution_;
  double factor_;
};

}  // namespace fv
