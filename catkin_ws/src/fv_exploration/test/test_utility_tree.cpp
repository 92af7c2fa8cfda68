// The files of utilities as OctoMap's own reader of .ot files, which octovis uses, meets them.
#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <unistd.h>

#include <cstdio>

#include "utility_tree.h"

namespace {

/// A file name that is nobody else's; removed at the end.
class TemporaryFile {
 public:
  TemporaryFile() : path_(::testing::TempDir() + "fv_utility_" + std::to_string(getpid()) + ".ot") {}
  ~TemporaryFile() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A map with three free voxels and one occupied, and utilities for two of the free ones.
struct Scene {
  fv::OccupancyMap map{fv::MapConfig{}};
  fv::Utility utility;
  Scene() {
    map.insertRays({{0.F, 0.F, 0.F}, {{0.18F, 0.01F, 0.01F}}, {}}, -1);
    utility.voxels = {{0, 0, 0}, {1, 0, 0}};
    utility.utility = {1.0 / 3.0, 2e9};
    utility.direction = {Eigen::Vector3f::UnitX(), Eigen::Vector3f(0.6F, 0.F, -0.8F)};
  }
};

TEST(UtilityTree, OctoMapsFactoryKnowsItAndLosesNothing) {
  const Scene scene;
  const TemporaryFile file;
  fv::writeUtilityTree(*fv::utilityTree(scene.map, scene.utility), file.path());
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(file.path()));
  const auto* tree = dynamic_cast<fv::UtilityOcTree*>(read.get());
  ASSERT_NE(tree, nullptr);
  EXPECT_EQ(tree->getResolution(), scene.map.resolution());
  for (std::size_t i = 0; i < 2; ++i) {
    const fv::UtilityOcTreeNode* node = tree->search(scene.map.tree().key(scene.utility.voxels[i]));
    ASSERT_NE(node, nullptr);
    EXPECT_EQ(node->utility, scene.utility.utility[i]);
    EXPECT_EQ(node->direction, scene.utility.direction[i]);
    EXPECT_EQ(node->getLogOdds(),
              scene.map.tree().search(scene.map.tree().key(scene.utility.voxels[i]))->getLogOdds());
  }
  EXPECT_EQ(tree->search(scene.map.tree().key({2, 0, 0}))->utility, 0.0);
}

TEST(UtilityTree, ColoursAreAColorOcTreeToOctoMap) {
  const Scene scene;
  const TemporaryFile file;
  fv::writeColorTree(scene.map, scene.utility, true, file.path());
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(file.path()));
  const auto* tree = dynamic_cast<octomap::ColorOcTree*>(read.get());
  ASSERT_NE(tree, nullptr);
  const auto color = [&](const fv::Voxel& v) { return tree->search(scene.map.tree().key(v))->getColor(); };
  EXPECT_EQ(color({1, 0, 0}), octomap::ColorOcTreeNode::Color(255, 0, 0));      // the most useful
  EXPECT_EQ(color({0, 0, 0}), octomap::ColorOcTreeNode::Color(0, 0, 254));      // the least
  EXPECT_EQ(color({3, 0, 0}), octomap::ColorOcTreeNode::Color(128, 128, 128));  // an obstacle
  EXPECT_EQ(tree->search(scene.map.tree().key({2, 0, 0})), nullptr);
}

}  // namespace
