/// Quick answers about maps against slow ones: payloads read without a tree, blocks, roadmaps' question.
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <random>

#include "obstacle_blocks.h"
#include "roadmap_memory.h"
#include "scenes.h"

namespace ompl_planner {
namespace {

constexpr double kResolution = 0.05;
const Eigen::AlignedBox3d kRegion(Eigen::Vector3d(-0.5, -0.4, -0.3), Eigen::Vector3d(0.49, 0.39, 0.29));

/// A tree with pruned and single leaves, partly outside of the region.
std::unique_ptr<octomap::OcTree> randomTree(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at(-0.9, 0.9), edge(0.05, 0.6);
  const auto box = [&] {
    const Eigen::Vector3d low(at(random), at(random), at(random));
    return Eigen::AlignedBox3d(low, low + Eigen::Vector3d(edge(random), edge(random), edge(random)));
  };
  BoxScene scene;
  scene.resolution_m = kResolution;
  for (int i = 0; i < 12; ++i) scene.free.push_back(box());
  for (int i = 0; i < 8; ++i) scene.occupied.push_back(box());
  for (int i = 0; i < 4; ++i) scene.unknown.push_back(box());
  return makeOctree(scene);
}

VoxelGrid read(const std::string& payload) {
  return VoxelGrid::fromBinaryPayload(payload.data(), payload.size(), kResolution, kRegion);
}

TEST(BinaryPayload, GivesTheGridOfItsTree) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    const auto tree = randomTree(seed);
    const VoxelGrid expected = VoxelGrid::fromOctree(*tree, kRegion);
    EXPECT_TRUE(read(binaryPayload(*tree)).changedSince(expected).empty());
  }
}

TEST(BinaryPayload, BrokenDataAreRefusedWhereverTheyBreak) {
  const std::string payload = binaryPayload(*randomTree(3));
  EXPECT_THROW(read(""), std::invalid_argument);
  EXPECT_THROW(read(std::string(2, '\0')), std::invalid_argument) << "no voxels";
  EXPECT_THROW(read(payload + "xx"), std::invalid_argument) << "more than a tree";
  for (std::size_t size = 1; size < payload.size(); size += 7) {
    EXPECT_THROW(read(payload.substr(0, size)), std::invalid_argument) << size;
  }
  EXPECT_THROW(read(std::string(4096, '\xff')), std::invalid_argument) << "deeper than a tree can be";
}

TEST(VoxelGrid, RefusesResolutionsAndPlacesThatNoIndexCanTell) {
  for (const double resolution : {1e-306, 1e-300, 1e-12, 1e-5})
    EXPECT_THROW(VoxelGrid(resolution, kRegion), std::invalid_argument) << resolution;
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(1e9);
  EXPECT_THROW(VoxelGrid(0.05, {far, far + Eigen::Vector3d::Ones()}), std::invalid_argument);
  EXPECT_THROW(VoxelGrid(0.05, {-far - Eigen::Vector3d::Ones(), -far}), std::invalid_argument);
  EXPECT_EQ(VoxelGrid(1e300, kRegion).count(), 8U) << "one voxel on either side of the origin";
}

TEST(ObstacleBlocks, VisitEveryObstacleOfABoxOnceAndNothingOutsideOfIt) {
  std::mt19937 random(1);
  VoxelGrid grid(kResolution, kRegion);
  for (std::size_t i = 0; i < grid.count(); ++i)
    grid.setOffset(i, random() % 100 == 0 ? Voxel::Occupied : Voxel::Free);
  const ObstacleBlocks blocks(grid);
  for (int round = 0; round < 300; ++round) {
    VoxelIndex low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const int a = static_cast<int>(random() % static_cast<unsigned>(grid.size()[axis]));
      const int b = static_cast<int>(random() % static_cast<unsigned>(grid.size()[axis]));
      low[axis] = grid.origin()[axis] + std::min(a, b);
      high[axis] = grid.origin()[axis] + std::max(a, b);
    }
    const auto obstacles = [&](const VoxelIndex& first, const VoxelIndex& last) {
      int count = 0;
      for (int x = first.x(); x <= last.x(); ++x)
        for (int y = first.y(); y <= last.y(); ++y)
          for (int z = first.z(); z <= last.z(); ++z) count += grid.at({x, y, z}) != Voxel::Free;
      return count;
    };
    int visited = 0;
    const auto visit = [&](const VoxelIndex& first, const VoxelIndex& last) {
      EXPECT_TRUE((first.array() >= low.array()).all() && (last.array() <= high.array()).all());
      visited += obstacles(first, last);
      return true;
    };
    EXPECT_TRUE(blocks.visitBlocked(low, high, visit));
    EXPECT_EQ(visited, obstacles(low, high));
  }
}

TEST(OnlyFreed, IsAboutWhatThePolicyTakesForFree) {
  VoxelGrid older(kResolution, kRegion);
  older.setOffset(0, Voxel::Free);
  VoxelGrid newer = older;
  newer.setOffset(1, Voxel::Free);
  newer.setOffset(2, Voxel::Occupied);
  EXPECT_TRUE(onlyFreed(older, newer, UnknownSpace::Obstacle));
  EXPECT_FALSE(onlyFreed(older, newer, UnknownSpace::Free)) << "unknown was free there, now it is occupied";
  newer.setOffset(0, Voxel::Unknown);
  EXPECT_FALSE(onlyFreed(older, newer, UnknownSpace::Obstacle));
  EXPECT_FALSE(onlyFreed(older, VoxelGrid(0.1, kRegion), UnknownSpace::Obstacle));
}

}  // namespace
}  // namespace ompl_planner
