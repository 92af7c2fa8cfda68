/// Which of the stored directions are near a given one? In constant time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capability_map/sphere_grid.h"

namespace capability_map {

/// Octahedral texture over the sphere; each texel lists the directions that can matter inside of it.
class DirectionLookup {
 public:
  /// Numbers of directions, a view into the lookup.
  struct Range {
    const int32_t* first;
    const int32_t* last;
    const int32_t* begin() const { return first; }
    const int32_t* end() const { return last; }
  };

  /// @param directions (N, 3) unit vectors, N >= 1.
  /// @param reach_rad How far from a given direction around() looks, in (0, pi).
  /// @throws std::invalid_argument for vectors that are not unit, for none, or a reach out of range.
  DirectionLookup(const Points& directions, double reach_rad);

  /// The nearest direction. @param d Unit vector.
  int nearest(const Eigen::Vector3d& d) const;
  /// Every direction within the reach of d, and some that are a little beyond it.
  Range around(const Eigen::Vector3d& d) const;

  const std::vector<Eigen::Vector3d>& directions() const { return directions_; }
  double reachRad() const { return reach_rad_; }

 private:
  struct Lists {  // items of texel t are item[start[t]] .. item[start[t + 1]]
    std::vector<int32_t> start;
    std::vector<int32_t> item;
    Range of(size_t texel) const { return {item.data() + start[texel], item.data() + start[texel + 1]}; }
  };
  size_t texelAt(const Eigen::Vector3d& d) const;
  void listTexel(int texel);

  std::vector<Eigen::Vector3d> directions_;
  double reach_rad_;
  Lists near_;
  Lists around_;
};

}  // namespace capability_map
