/// Cones, double cones and rings that stand for reachability spheres (thesis 3.2, step 2).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capability_map/sphere_grid.h"

namespace capability_map {

enum class ShapeType : uint8_t { Empty = 0, Cone = 1, DoubleCone = 2, Ring = 3 };

/// How the opening angle is chosen.
enum class AngleRule : uint8_t {
  CoverAll = 0,   ///< The thesis's: the smallest cone, or the narrowest ring, that covers every valid point.
  LeastError = 1  ///< The angle of least shape fit error, by a sweep over the sorted angles of all points.
};

/// A shape about an axis; with angle = angle between axis and a sphere point's n-vector, it covers
/// Cone: angle <= opening; DoubleCone: min(angle, pi - angle) <= opening; Ring: min(angle, pi - angle) >=
/// opening.
struct Shape {
  ShapeType type{ShapeType::Empty};
  Eigen::Vector3d axis{0.0, 0.0, 1.0};  ///< Unit vector, base frame; a cone widens along it.
  double opening_rad{0.0};              ///< In [0, pi] for a cone, else [0, pi / 2].
  double error_percent{0.0};            ///< Shape fit error SFE (3.8), 0..100.

  bool covers(const Eigen::Vector3d& n) const;
};

/// The shape of one type with axis by (3.10) or (3.12).
/// @param outward (N, 3) n-vectors. @param valid N flags, at least one set.
Shape fitShape(const Points& outward, const std::vector<bool>& valid, ShapeType type, AngleRule rule);

/// The type of least error; ties go to the simpler shape, in the order of ShapeType. Empty when nothing is
/// valid.
Shape fitBestShape(const Points& outward, const std::vector<bool>& valid, AngleRule rule);

}  // namespace capability_map
