/// Scenes of boxes as octrees, for tests and benchmarks: what is free, occupied and unknown is known by
/// construction.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

namespace octomap {
class OcTree;
}

namespace ompl_planner {

/// Later boxes overwrite earlier ones: first free, then occupied, then unknown. All in the map frame [m]; a
/// voxel belongs to a box when its centre does.
struct BoxScene {
  double resolution_m{0.02};
  std::vector<Eigen::AlignedBox3d> free;
  std::vector<Eigen::AlignedBox3d> occupied;
  std::vector<Eigen::AlignedBox3d> unknown;
};

/// @throws std::invalid_argument unless the resolution is positive.
std::unique_ptr<octomap::OcTree> makeOctree(const BoxScene& scene);

/// The payload of an octomap_msgs/Octomap with binary = true.
std::string binaryPayload(const octomap::OcTree& tree);

}  // namespace ompl_planner
