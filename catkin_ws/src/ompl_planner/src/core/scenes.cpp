#include "scenes.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace ompl_planner {
namespace {

/// Calls `visit` with the key of each voxel whose centre lies in the box.
template <typename Visit>
void forEachVoxel(const Eigen::AlignedBox3d& box, double resolution, const Visit& visit) {
  if (box.isEmpty()) return;
  constexpr int kKeyOffset = 32768;
  const Eigen::Vector3i low =
      (box.min() / resolution - Eigen::Vector3d::Constant(0.5)).array().ceil().cast<int>();
  const Eigen::Vector3i high =
      (box.max() / resolution - Eigen::Vector3d::Constant(0.5)).array().floor().cast<int>();
  const auto key = [](int index) { return static_cast<octomap::key_type>(index + kKeyOffset); };
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int z = low.z(); z <= high.z(); ++z) visit(octomap::OcTreeKey(key(x), key(y), key(z)));
    }
  }
}

}  // namespace

std::unique_ptr<octomap::OcTree> makeOctree(const BoxScene& scene) {
  if (!(scene.resolution_m > 0.0)) throw std::invalid_argument("scene: resolution must be positive");
  auto tree = std::make_unique<octomap::OcTree>(scene.resolution_m);
  const auto unknown = [&](const octomap::OcTreeKey& key) {
    const octomap::point3d p = tree->keyToCoord(key);
    const Eigen::Vector3d center(p.x(), p.y(), p.z());
    return std::any_of(scene.unknown.begin(), scene.unknown.end(),
                       [&](const Eigen::AlignedBox3d& box) { return box.contains(center); });
  };
  const auto fill = [&](const std::vector<Eigen::AlignedBox3d>& boxes, float log_odds) {
    for (const auto& box : boxes) {
      forEachVoxel(box, scene.resolution_m, [&](const octomap::OcTreeKey& key) {
        if (!unknown(key)) tree->setNodeValue(key, log_odds, /*lazy_eval=*/true);
      });
    }
  };
  fill(scene.free, tree->getClampingThresMinLog());
  fill(scene.occupied, tree->getClampingThresMaxLog());
  if (tree->getRoot() != nullptr) tree->updateInnerOccupancy();
  tree->prune();
  return tree;
}

std::string binaryPayload(const octomap::OcTree& tree) {
  std::ostringstream stream;
  tree.writeBinaryData(stream);
  return stream.str();
}

}  // namespace ompl_planner
