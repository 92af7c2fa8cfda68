#include "utility_tree.h"

#include <octomap/ColorOcTree.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "fv_exploration/map_file.h"

namespace fv {

void UtilityOcTreeNode::copyData(const UtilityOcTreeNode& from) {
  OcTreeNode::copyData(from);
  utility = from.utility;
  direction = from.direction;
}

std::istream& UtilityOcTreeNode::readData(std::istream& stream) {
  OcTreeNode::readData(stream);
  stream.read(reinterpret_cast<char*>(&utility), sizeof(utility));
  return stream.read(reinterpret_cast<char*>(direction.data()), 3 * sizeof(float));
}

std::ostream& UtilityOcTreeNode::writeData(std::ostream& stream) const {
  OcTreeNode::writeData(stream);
  stream.write(reinterpret_cast<const char*>(&utility), sizeof(utility));
  return stream.write(reinterpret_cast<const char*>(direction.data()), 3 * sizeof(float));
}

UtilityOcTree::Registration UtilityOcTree::registration_;

UtilityOcTree::Registration::Registration() {
  auto* prototype = new UtilityOcTree(0.1);  // OctoMap's factory keeps it
  prototype->clearKeyRays();
  octomap::AbstractOcTree::registerTreeType(prototype);
}

UtilityOcTree::UtilityOcTree(double resolution_m) : OccupancyOcTreeBase<UtilityOcTreeNode>(resolution_m) {
  registration_.ensureLinking();
}

void UtilityOcTree::copyOccupancy(const OccupancyTree& from) {
  clear();
  if (!from.getRoot()) return;
  root = new UtilityOcTreeNode();
  ++tree_size;
  size_changed = true;
  copyBelow(from, from.getRoot(), root);
}

void UtilityOcTree::copyBelow(const OccupancyTree& from, const octomap::OcTreeNode* source,
                              UtilityOcTreeNode* target) {
  target->setLogOdds(source->getLogOdds());
  if (!from.nodeHasChildren(source)) return;
  for (unsigned i = 0; i < 8; ++i)
    if (from.nodeChildExists(source, i))
      copyBelow(from, from.getNodeChild(source, i), createNodeChild(target, i));
}

namespace {

void setBelow(UtilityOcTree& tree, UtilityOcTreeNode* node, const octomap::OcTreeKey& key, int depth,
              const UtilityOcTreeNode& data) {
  if (depth == 16) {
    node->utility = data.utility;
    node->direction = data.direction;
    return;
  }
  const unsigned child = octomap::computeChildIdx(key, 15 - depth);
  if (!tree.nodeHasChildren(node)) tree.expandNode(node);
  setBelow(tree, tree.getNodeChild(node, child), key, depth + 1, data);
}

template <class Tree>
void writeTree(const Tree& tree, const std::string& path) {
  std::ofstream stream(path, std::ios::binary);
  if (!stream || !tree.write(stream) || !stream.flush()) throw MapFileError(path + ": cannot be written");
}

}  // namespace

std::unique_ptr<UtilityOcTree> utilityTree(const OccupancyMap& map, const Utility& utility) {
  auto tree = std::make_unique<UtilityOcTree>(map.resolution());
  tree->copyOccupancy(map.tree());
  UtilityOcTreeNode data;
  for (std::size_t i = 0; i < utility.voxels.size(); ++i) {
    const octomap::OcTreeKey key = map.tree().key(utility.voxels[i]);
    if (!map.tree().search(key))
      throw InputError("utility has a voxel that the map does not know; valid: utility of this map");
    data.utility = utility.utility[i];
    data.direction = utility.direction[i];
    setBelow(*tree, tree->getRoot(), key, 0, data);
  }
  tree->prune();
  return tree;
}

void writeUtilityTree(const UtilityOcTree& tree, const std::string& path) { writeTree(tree, path); }

std::unique_ptr<UtilityOcTree> readUtilityTree(const std::string& path) {
  const OtFile file = readOtFile(path, "UtilityOcTree", UtilityOcTreeNode::kPayloadBytes);
  auto tree = std::make_unique<UtilityOcTree>(file.resolution_m);
  std::istringstream stream(file.payload);
  if (file.nodes > 0) tree->readData(stream);
  return tree;
}

void writeColorTree(const OccupancyMap& map, const Utility& utility, bool with_obstacles,
                    const std::string& path) {
  octomap::ColorOcTree tree(map.resolution());
  const double top =
      utility.utility.empty() ? 1.0 : *std::max_element(utility.utility.begin(), utility.utility.end());
  const auto paint = [&](const Voxel& v, uint8_t r, uint8_t g, uint8_t b) {
    const octomap::OcTreeKey key = map.tree().key(v);
    tree.setNodeValue(key, map.tree().getClampingThresMaxLog(), true);
    tree.setNodeColor(key, r, g, b);
  };
  for (std::size_t i = 0; i < utility.voxels.size(); ++i) {
    const double share = utility.utility[i] / top;
    paint(utility.voxels[i], static_cast<uint8_t>(255 * share),
          static_cast<uint8_t>(255 * (1 - std::abs(2 * share - 1))), static_cast<uint8_t>(255 * (1 - share)));
  }
  if (with_obstacles)
    for (std::size_t i = 0; i < map.classes().size(); ++i)
      if (map.classes()[i] == kOccupied) paint(map.frame().voxel(i), 128, 128, 128);
  if (tree.size() > 0) tree.updateInnerOccupancy();  // it reads the root, which an empty tree lacks
  writeTree(tree, path);
}

}  // namespace fv
