// The inner loops of each instruction set that this processor has, against the plain ones: they must not
// differ by a bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "fv_exploration/errors.h"
#include "lane_kernels.h"

namespace {

using fv::kLanes;

constexpr int kEdge = 40;
constexpr std::size_t kCells = std::size_t{kEdge} * kEdge * kEdge;
constexpr uint8_t kMark = 1;

/// Any meaning of the flags will do: of the 16 every third ends rays.
fv::GainTable anyTable() {
  fv::GainTable table;
  for (int flags = 0; flags < fv::kViewStep; ++flags) {
    table.open[flags] = flags % 3 == 2 ? 0 : -1;
    table.adds[flags] = (flags & 1 ? fv::GainTable::kOneVoid : 0) +
                        (flags & 2 ? fv::GainTable::kOneUnknown : 0) +
                        (flags & 4 ? fv::GainTable::kOneFrontier : 0);
  }
  return table;
}
const fv::GainTable kTable = anyTable();

/// Mostly one kind that is open, some of every other.
std::vector<uint8_t> randomFlags(std::mt19937& random) {
  std::vector<uint8_t> flags(kCells);
  for (uint8_t& f : flags) f = random() % 10 ? 1 : random() % fv::kViewStep;
  return flags;
}

/// Any direction; now and then one along an axis or a diagonal.
Eigen::Vector3d randomDirection(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Vector3d d(normal(random), normal(random), normal(random));
  if (random() % 4 == 0) d = Eigen::Vector3d(random() % 3 - 1.0, random() % 3 - 1.0, 1.0);
  return d;
}

fv::Voxel randomVoxel(std::mt19937& random) {
  return {static_cast<int>(random() % kEdge), static_cast<int>(random() % kEdge),
          static_cast<int>(random() % kEdge)};
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

/// A walk from a random place of the grid.
fv::GridWalk randomWalk(std::mt19937& random) {
  std::uniform_real_distribution<double> place(0, kEdge);
  const Eigen::Vector3d origin(place(random), place(random), place(random));
  const Eigen::Vector3d direction = randomDirection(random).normalized();
  fv::GridWalk walk;
  int64_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    walk.begin(axis, origin[axis], direction[axis], 0.0, kEdge, stride);
    stride *= kEdge;
  }
  return walk;
}

/// A ray of a scan: to a voxel on its way, or to one beside it, where only the length ends it.
void setMark(std::mt19937& random, int lane, fv::MarkLanes& lanes) {
  fv::GridWalk walk = randomWalk(random);
  for (int axis = 0; axis < 3; ++axis) {
    lanes.t[axis][lane] = walk.t[axis];
    lanes.delta[axis][lane] = walk.delta[axis];
    lanes.step[axis][lane] = walk.step[axis];
  }
  lanes.at[lane] = walk.at;
  lanes.length[lane] = 0;
  for (int steps = static_cast<int>(random() % 50); steps > 0; --steps) {
    const int axis = walk.t[0] < walk.t[1] && walk.t[0] < walk.t[2] ? 0 : walk.t[1] < walk.t[2] ? 1 : 2;
    if (walk.left[axis]-- == 0) break;
    lanes.length[lane] = walk.t[axis];
    walk.at += walk.step[axis];
    walk.t[axis] += walk.delta[axis];
  }
  lanes.end[lane] = random() % 2 ? walk.at : -1;
}

/// Several batches of eight.
std::vector<uint8_t> marksOf(const fv::LaneKernels& kernels, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<uint8_t> grid(kCells, 0);
  for (int batch = 0; batch < 20; ++batch) {
    fv::MarkLanes lanes;
    for (int lane = 0; lane < kLanes; ++lane) setMark(random, lane, lanes);
    kernels.markLanes(lanes, kMark, grid.data());
  }
  return grid;
}

struct Cast {
  std::vector<int64_t> counts;
  std::vector<uint16_t> cells;
  bool operator==(const Cast& o) const { return counts == o.counts && cells == o.cells; }
};

/// Views of a few batches each, the last of which is not full.
Cast castsOf(const fv::LaneKernels& kernels, unsigned seed) {
  std::mt19937 random(seed);
  const std::vector<uint8_t> flags = randomFlags(random);
  Cast out{{}, {flags.begin(), flags.end()}};
  for (uint16_t view = 1; view < 6; ++view) {
    fv::GainCounts counts;
    for (int batch = 0; batch < 5; ++batch) {
      fv::LaneRays rays;
      for (int lane = 0; lane < kLanes; ++lane) {
        if (batch == 4 && lane > static_cast<int>(random() % kLanes))
          rays.clear(lane);
        else
          rays.set(lane, randomWalk(random), random() % 50);
      }
      const double min_range = random() % 5;
      const fv::GainGrid grid{&kTable, out.cells.data(), static_cast<uint16_t>(view * fv::kViewStep),
                              min_range};
      kernels.castLanes(rays, grid, counts);
    }
    out.counts.insert(out.counts.end(), {counts.voids, counts.unknown, counts.frontier, counts.occupied});
  }
  return out;
}

struct Added {
  int64_t visits;
  std::vector<fv::UtilitySums> sums;
};

Added addedBy(const fv::LaneKernels& kernels, unsigned seed, int count) {
  std::mt19937 random(seed);
  const std::vector<uint8_t> flags = randomFlags(random);
  fv::RayBlock block;
  fillBlock(random, count, block);
  Added out{0, std::vector<fv::UtilitySums>(kCells)};
  const fv::UtilityGrid grid{flags.data(), kTable.open, {kEdge, kEdge, kEdge}, 25.0};
  out.visits = kernels.addRays(block, grid, out.sums.data());
  return out;
}

TEST(LaneKernels, ThePlainOnesAreAlwaysThereAndComeLast) {
  const std::vector<fv::LaneKernels> all = fv::laneKernels();
  EXPECT_EQ(all.back().instruction_set, std::string("plain"));
#if defined(__x86_64__) || defined(__aarch64__)
  EXPECT_GE(all.size(), 2u);
#endif
}

TEST(LaneKernels, MarksAreThoseOfThePlainLoop) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const std::vector<uint8_t> expected = marksOf(fv::plainKernels(), seed);
    EXPECT_GT(std::count(expected.begin(), expected.end(), kMark), 500);
    for (const fv::LaneKernels& kernels : fv::laneKernels())
      EXPECT_EQ(marksOf(kernels, seed), expected) << kernels.instruction_set << ", seed " << seed;
  }
}

TEST(LaneKernels, GainsAreThoseOfThePlainLoop) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Cast expected = castsOf(fv::plainKernels(), seed);
    for (const int64_t count : expected.counts) EXPECT_GT(count, 0) << "seed " << seed;
    for (const fv::LaneKernels& kernels : fv::laneKernels())
      EXPECT_TRUE(castsOf(kernels, seed) == expected) << kernels.instruction_set << ", seed " << seed;
  }
}

TEST(LaneKernels, UtilityIsThatOfThePlainLoop) {
  for (const int count : {0, 1, 7, 8, 9, 100, fv::RayBlock::kCapacity}) {
    const Added expected = addedBy(fv::plainKernels(), count, count);
    EXPECT_GE(expected.visits, count / 2);
    for (const fv::LaneKernels& kernels : fv::laneKernels()) {
      const Added added = addedBy(kernels, count, count);
      EXPECT_EQ(added.visits, expected.visits) << kernels.instruction_set << ", " << count << " rays";
      EXPECT_EQ(added.sums, expected.sums) << kernels.instruction_set << ", " << count << " rays";
    }
  }
}

TEST(LaneKernels, ACapAllowsWhatIsNotAboveIt) {
  const std::vector<fv::LaneKernels> all = fv::laneKernels();
  EXPECT_EQ(fv::cappedKernels("").instruction_set, std::string(all.front().instruction_set));
  for (const fv::LaneKernels& kernels : all)
    EXPECT_EQ(fv::cappedKernels(kernels.instruction_set).instruction_set, kernels.instruction_set);
#if defined(__x86_64__)
  EXPECT_EQ(fv::cappedKernels("avx512").instruction_set, std::string(all.front().instruction_set));
#endif
}

TEST(LaneKernels, AnUnknownCapIsRefusedWithTheValidOnes) {
  for (const char* cap : {"AVX2", "sse", " "}) {
    try {
      fv::cappedKernels(cap);
      FAIL() << cap;
    } catch (const fv::InputError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find("FV_INSTRUCTION_SET is '" + std::string(cap) + "'"), std::string::npos) << text;
      EXPECT_NE(text.find("plain"), std::string::npos) << text;
    }
  }
}

}  // namespace
