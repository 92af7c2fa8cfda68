/// Capability maps as files, for C++ callers: the same checks as store.py, which writes them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "capability_map/capability_query.h"
#include "capability_map/seed_lookup.h"
#include "capability_map/shape_fit.h"

namespace capability_map {

/// Missing, damaged, foreign, of another schema, or made for another URDF; the message names the file.
class MapFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The content of a map that queries need. Everything is in the base frame.
struct MapFile {
  std::string robot, group, base_frame, tip_frame;
  std::string urdf_sha256;  ///< Of kinematics and collision geometry (identity.py).
  std::string backend;      ///< Which inverse kinematics decided, and why.
  double threshold{0.0};    ///< An interpolated answer at or above it counts as reachable.
  ArmPivots pivots;
  SphereGrid grid;
  Points view_directions;  ///< (N, 3) the tip's z at the sphere points.
  SphereBits bits;
  std::vector<Shape> shapes;        ///< Of least error, one per row of bits.
  Eigen::MatrixX2d joint_limits;    ///< (J, 2) in the order of the group's joints [rad or m].
  std::vector<uint16_t> witnesses;  ///< (V, J) 65535ths of the joints' ranges, one row per valid point.

  CapabilityQuery query() const { return {grid, view_directions, bits, pivots}; }
  SeedLookup seeds() const { return {grid, view_directions, bits}; }
  /// Does the shape of the view's sphere cover it? Compact but coarse; false outside.
  /// @throws std::invalid_argument as viewDirection().
  bool covered(const Eigen::Vector3d& position, const Eigen::Vector3d& direction) const;
  /// The configuration that holds a valid point. @param q Room for J values.
  void witness(int64_t point, double* q) const;
};

/// @param urdf_sha256 The robot's; a map of another one is refused. Empty: not asked.
/// @throws MapFileError.
MapFile loadMapFile(const std::string& path, const std::string& urdf_sha256 = "");

}  // namespace capability_map
