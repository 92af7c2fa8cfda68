// The inner loops for each instruction set that this processor has: they must not differ by a bit.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "lane_kernels.h"

namespace {

using fv::kLanes;

constexpr int kEdge = 40;
constexpr std::size_t kCells = std::size_t{kEdge} * kEdge * kEdge;

/// Mostly free voxels, some of every other kind.
std::vector<uint8_t> randomFlags(std::mt19937& random) {
  std::vector<uint8_t> flags(kCells);
  for (uint8_t& f : flags) {
    const unsigned kind = random() % 40;
    f = kind == 0 ? fv::kOccupied : kind < 4 ? fv::kUnknown : fv::kFree;
    if (f == fv::kFree && random() % 5 == 0) f |= fv::Evaluator::kFrontierFlag;
    if (f == fv::kUnknown && random() % 2 == 0) f |= fv::Evaluator::kVoidFlag;
  }
  return flags;
}

fv::Voxel randomVoxel(std::mt19937& random) {
  return {static_cast<int>(random() % kEdge), static_cast<int>(random() % kEdge),
          static_cast<int>(random() % kEdge)};
}

/// Any direction; now and then one along an axis or a diagonal.
Eigen::Vector3d randomDirection(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Vector3d d(normal(random), normal(random), normal(random));
  if (random() % 4 == 0) d = Eigen::Vector3d(random() % 3 - 1.0, random() % 3 - 1.0, 1.0);
  return d;
}

int64_t indexOf(const fv::Voxel& v) { return v.x() + kEdge * (v.y() + int64_t{kEdge} * v.z()); }

void fillBlock(std::mt19937& random, int count, fv::RayBlock& block) {
  block.count = count;
  for (int i = 0; i < count; ++i) {
    const fv::Voxel from = randomVoxel(random);
    const Eigen::Vector3d away = randomDirection(random);
    for (int axis = 0; axis < 3; ++axis) {
      block.away[axis][i] = away[axis];
      block.voxel[axis][i] = from[axis];
    }
    block.at[i] = indexOf(from);
    block.weight[i] = static_cast<double>(random() % 100000);
  }
}

/// A block's rays one after the other, as Algorithm 1 has it.
int64_t plainRays(const fv::RayBlock& block, const std::vector<uint8_t>& flags, double range,
                  std::vector<int64_t>& sums) {
  int64_t visits = 0;
  for (int i = 0; i < block.count; ++i) {
    fv::Voxel at(block.voxel[0][i], block.voxel[1][i], block.voxel[2][i]);
    Eigen::Vector3d d(block.away[0][i], block.away[1][i], block.away[2][i]);
    d /= std::sqrt(d.x() * d.x() + d.y() * d.y() + d.z() * d.z());
    Eigen::Vector3d t = 0.5 * d.cwiseAbs().cwiseInverse();
    while ((at.array() >= 0).all() && (at.array() < kEdge).all() &&
           (flags[indexOf(at)] & fv::Evaluator::kClassMask) == fv::kFree) {
      sums[indexOf(at)] += static_cast<int64_t>(block.weight[i] + 0.5);
      ++visits;
      if (t.minCoeff() > range) break;
      const int axis = t[0] < t[1] && t[0] < t[2] ? 0 : !(t[0] < t[1]) && t[1] < t[2] ? 1 : 2;
      at[axis] += d[axis] > 0 ? 1 : -1;
      t[axis] += 1.0 / std::fabs(d[axis]);
    }
  }
  return visits;
}

TEST(LaneKernels, TheBaselineIsAlwaysThereAndComesLast) {
  EXPECT_EQ(fv::laneKernels().back().instructions, std::string("baseline"));
  EXPECT_EQ(fv::bestKernels().instructions, fv::laneKernels().front().instructions);
}

TEST(LaneKernels, UtilityRaysAreThoseOfThePlainLoop) {
  for (const fv::LaneKernels& kernels : fv::laneKernels()) {
    SCOPED_TRACE(kernels.instructions);
    std::mt19937 random(3);
    for (const int count : {0, 1, 7, 8, 9, 100, fv::RayBlock::kCapacity}) {
      const std::vector<uint8_t> flags = randomFlags(random);
      fv::RayBlock block;
      fillBlock(random, count, block);
      std::vector<int64_t> expected(kCells, 0);
      const int64_t visits = plainRays(block, flags, 25.0, expected);
      const fv::UtilityGrid grid{flags.data(), {kEdge, kEdge, kEdge}, 25.0};
      std::vector<int64_t> memory(4 * kCells + 8, 0);
      const auto address = (reinterpret_cast<std::uintptr_t>(memory.data()) + 31) / 32 * 32;
      EXPECT_EQ(kernels.addRays(block, grid, reinterpret_cast<fv::UtilitySums*>(address)), visits);
      const auto* sums = reinterpret_cast<const int64_t*>(address);
      for (std::size_t i = 0; i < kCells; ++i) ASSERT_EQ(sums[4 * i], expected[i]) << i;
    }
  }
}

TEST(LaneKernels, DirectionsGainsAndMarksAreTheSameForEveryInstructionSet) {
  std::vector<std::vector<int64_t>> results;
  for (const fv::LaneKernels& kernels : fv::laneKernels()) {
    std::mt19937 random(9);
    const std::vector<uint8_t> flags = randomFlags(random);
    fv::RayBlock block;
    fillBlock(random, fv::RayBlock::kCapacity, block);
    const fv::UtilityGrid grid{flags.data(), {kEdge, kEdge, kEdge}, 30.0};
    std::vector<int64_t> all(4 * kCells + 8, 0);
    const auto address = (reinterpret_cast<std::uintptr_t>(all.data()) + 31) / 32 * 32;
    kernels.addRays(block, grid, reinterpret_cast<fv::UtilitySums*>(address));
    std::vector<int64_t> result(reinterpret_cast<int64_t*>(address),
                                reinterpret_cast<int64_t*>(address) + 4 * kCells);
    std::vector<uint16_t> counted(kCells, 0);
    std::vector<uint8_t> marks(kCells, 0);
    for (int first = 0; first + kLanes <= fv::RayBlock::kCapacity; first += kLanes) {
      fv::LaneRays rays;
      fv::MarkLanes scan;
      for (int lane = 0; lane < kLanes; ++lane) {
        const int i = first + lane;
        for (int axis = 0; axis < 3; ++axis) {
          scan.t[axis][lane] = rays.t[axis][lane] = block.t[axis][i];
          scan.delta[axis][lane] = rays.delta[axis][lane] = block.delta[axis][i];
          scan.step[axis][lane] = rays.step[axis][lane] = block.step[axis][i];
          rays.left[axis][lane] = block.left[axis][i];
        }
        scan.at[lane] = rays.at[lane] = block.at[i];
        rays.end[lane] = 20.0;
        rays.live[lane] = -1;
        double room = kEdge;  // so far the ray stays in the grid
        for (int axis = 0; axis < 3; ++axis)
          room = std::min(room, (block.left[axis][i] - 0.5) * block.delta[axis][i]);
        scan.length[lane] = std::max(0.0, room);
        scan.end[lane] = room > 0 ? -1 : block.at[i];
      }
      fv::GainCounts counts;
      kernels.castLanes(rays, {flags.data(), counted.data(), static_cast<uint16_t>(first / kLanes + 1), 2.0},
                        counts);
      for (const int64_t c : {counts.voids, counts.unknown, counts.frontier, counts.occupied})
        result.push_back(c);
      kernels.markLanes(scan, 0, marks.data());
    }
    result.insert(result.end(), marks.begin(), marks.end());
    result.insert(result.end(), counted.begin(), counted.end());
    EXPECT_GT(std::count(marks.begin(), marks.end(), fv::kMiss), 500);
    results.push_back(result);
  }
  for (const std::vector<int64_t>& result : results) EXPECT_EQ(result, results.back());
}

}  // namespace
