/// The field against brute force, and the grid against the octree it was copied from.
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "distance_field.h"
#include "scenes.h"

namespace ompl_planner {
namespace {

constexpr double kResolution = 0.05;
const Eigen::AlignedBox3d kRegion(Eigen::Vector3d(-0.5, -0.4, -0.3), Eigen::Vector3d(0.49, 0.39, 0.29));

VoxelGrid randomGrid(unsigned seed, double obstacle_share) {
  VoxelGrid grid(kResolution, kRegion);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (std::size_t i = 0; i < grid.count(); ++i) {
    grid.setOffset(i, unit(random) < obstacle_share ? Voxel::Occupied : Voxel::Free);
  }
  return grid;
}

double distanceToCube(const Eigen::Vector3d& p, const Eigen::Vector3d& center) {
  return ((p - center).cwiseAbs().array() - 0.5 * kResolution).max(0.0).matrix().norm();
}

double bruteForce(const VoxelGrid& grid, const Eigen::Vector3d& p) {
  double least = 1e9;
  for (std::size_t i = 0; i < grid.count(); ++i) {
    if (grid.atOffset(i) == Voxel::Free) continue;
    least = std::min(least, distanceToCube(p, grid.centerOf(grid.indexAt(i))));
  }
  return least;
}

TEST(DistanceField, NeverExceedsTheTrueDistanceAndIsCloseToIt) {
  const double cap = 0.3;
  for (unsigned seed = 0; seed < 5; ++seed) {
    const VoxelGrid grid = randomGrid(seed, 0.002 * (seed + 1));
    const DistanceField field(grid, kRegion, cap);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> x(-0.5, 0.49), y(-0.4, 0.39), z(-0.3, 0.29);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d p(x(random), y(random), z(random));
      const double truth = bruteForce(grid, p);
      EXPECT_LE(field.lowerBound(p), truth + 1e-6);
      // beyond the region everything counts as obstacle
      const double border = (kRegion.max() - p).cwiseMin(p - kRegion.min()).minCoeff();
      const double reachable = std::min({truth, cap, std::max(0.0, border)});
      EXPECT_GE(field.lowerBound(p), reachable - 2.0 * std::sqrt(3.0) * kResolution);
    }
  }
}

TEST(DistanceField, TellsObstacleVoxelsFromOthers) {
  const VoxelGrid grid = randomGrid(9, 0.05);
  const DistanceField field(grid, kRegion, 0.2);
  for (std::size_t i = 0; i < grid.count(); ++i) {
    EXPECT_EQ(field.inObstacle(grid.centerOf(grid.indexAt(i))), grid.atOffset(i) == Voxel::Occupied);
  }
  EXPECT_EQ(field.lowerBound({5.0, 0.0, 0.0}), -1.0);
}

TEST(DistanceField, RefusesRegionsAndCapsThatAreNone) {
  const VoxelGrid grid = randomGrid(1, 0.1);
  EXPECT_THROW(DistanceField(grid, kRegion, 0.0), std::invalid_argument);
  const Eigen::AlignedBox3d away(Eigen::Vector3d::Constant(5.0), Eigen::Vector3d::Constant(6.0));
  EXPECT_THROW(DistanceField(grid, away, 0.2), std::invalid_argument);
}

TEST(VoxelGrid, AgreesWithTheOctreeVoxelByVoxel) {
  BoxScene scene;
  scene.resolution_m = kResolution;
  scene.free = {{Eigen::Vector3d(-0.4, -0.4, -0.2), Eigen::Vector3d(0.8, 0.3, 0.3)}};
  scene.occupied = {{Eigen::Vector3d(0.1, 0.0, -0.2), Eigen::Vector3d(0.3, 0.1, 0.1)}};
  scene.unknown = {{Eigen::Vector3d(-0.3, -0.3, -0.1), Eigen::Vector3d(-0.1, 0.0, 0.0)}};
  const auto tree = makeOctree(scene);
  const VoxelGrid grid = VoxelGrid::fromOctree(*tree, kRegion);
  std::size_t counts[3] = {0, 0, 0};
  for (std::size_t i = 0; i < grid.count(); ++i) {
    const Eigen::Vector3d p = grid.centerOf(grid.indexAt(i));
    const auto* node = tree->search(p.x(), p.y(), p.z());
    const Voxel expected = node == nullptr              ? Voxel::Unknown
                           : tree->isNodeOccupied(node) ? Voxel::Occupied
                                                        : Voxel::Free;
    ASSERT_EQ(grid.atOffset(i), expected) << p.transpose();
    ++counts[static_cast<int>(expected)];
  }
  for (const std::size_t count : counts) EXPECT_GT(count, 0U);
  EXPECT_EQ(grid.at({1000, 0, 0}), Voxel::Unknown);
}

TEST(VoxelGrid, ListsWhatChanged) {
  VoxelGrid older(kResolution, kRegion);
  VoxelGrid newer = older;
  newer.set(VoxelIndex(1, 2, 3), Voxel::Occupied);
  ASSERT_EQ(newer.changedSince(older).size(), 1U);
  EXPECT_EQ(newer.indexAt(newer.changedSince(older)[0]), VoxelIndex(1, 2, 3));
  EXPECT_THROW(newer.changedSince(VoxelGrid(0.1, kRegion)), std::invalid_argument);
}

}  // namespace
}  // namespace ompl_planner
