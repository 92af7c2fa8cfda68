// Hulls that grow against hulls made at once, and both against the definition: a voxel is inside when no
// triangle has it on its outer side, and none of the voxels is outside.
#include <gtest/gtest.h>

#include <climits>
#include <cmath>
#include <ctime>
#include <random>

#include "convex_hull.h"

namespace {

using fv::GridFrame;
using fv::HullRows;
using fv::HullTriangle;
using fv::RowExtremes;
using fv::Voxel;

const GridFrame kFrame{Voxel(-32, -16, -32), Voxel(4, 3, 4)};

HullRows atOnce(const std::vector<Voxel>& voxels) {
  RowExtremes extremes;
  const HullRows rows(kFrame);
  extremes.low = rows.low;
  extremes.high = rows.high;
  for (const Voxel& v : voxels) {
    const std::size_t row = rows.row(v.y(), v.z());
    extremes.low[row] = std::min(extremes.low[row], v.x());
    extremes.high[row] = std::max(extremes.high[row], v.x());
  }
  return fv::hullOfRows(kFrame, extremes);
}

int64_t height(const HullRows& hull, const HullTriangle& triangle, const Voxel& v) {
  return triangle.normal.dot((v - hull.vertices[triangle.corners[0]]).cast<int64_t>());
}

void expectSurface(const HullRows& hull, const std::vector<Voxel>& voxels) {
  EXPECT_EQ(hull.triangles.size(), 2 * hull.vertices.size() - 4);  // Euler, of a closed surface of triangles
  for (const HullTriangle& triangle : hull.triangles)
    for (const Voxel& v : voxels) ASSERT_LE(height(hull, triangle, v), 0);
}

void expectRows(const HullRows& hull) {
  for (int z = kFrame.origin.z(); z < kFrame.end().z(); z += 3)
    for (int y = kFrame.origin.y(); y < kFrame.end().y(); y += 3)
      for (int x = kFrame.origin.x(); x < kFrame.end().x(); ++x) {
        bool inside = true;
        for (const HullTriangle& triangle : hull.triangles) inside &= height(hull, triangle, {x, y, z}) <= 0;
        ASSERT_EQ(hull.contains({x, y, z}), inside) << x << " " << y << " " << z;
      }
}

/// Voxels of kinds that hulls are afraid of.
std::vector<Voxel> some(int kind, int count, std::mt19937& rng) {
  const auto number = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(rng); };
  std::vector<Voxel> out;
  for (int i = 0; i < count; ++i) {
    const Voxel anywhere(number(-32, 31), number(-16, 31), number(-32, 31));
    const Voxel wall(number(-20, 20), number(-2, 2) > 0 ? 20 : -10, number(-20, 20));  // two planes
    const Voxel line(number(-20, 20), 5, 5);                                           // all in a line
    const Voxel lattice(8 * number(-2, 2), 8 * number(-1, 2), 8 * number(-2, 2));      // many in each plane
    const Voxel floor(number(-20, 20), number(-10, 20),
                      i == 0 ? number(-20, -19) : -20);  // hardly spans space
    out.push_back(std::array<Voxel, 5>{anywhere, wall, line, lattice, floor}[kind % 5]);
  }
  return out;
}

TEST(ConvexHull, GrownIsAsMadeAtOnce) {
  std::mt19937 rng(3);
  for (int sequence = 0; sequence < 60; ++sequence) {
    std::vector<Voxel> all = some(sequence, 30, rng);
    HullRows grown = atOnce(all);
    for (int step = 0; step < 6; ++step) {
      const std::vector<Voxel> more = some(sequence / 5 + step, 1 + 40 * (step % 2), rng);
      all.insert(all.end(), more.begin(), more.end());
      const HullRows whole = atOnce(all);
      if (grown.empty()) {
        grown = whole;
        continue;
      }
      grown.grow(more);
      ASSERT_EQ(grown.low, whole.low) << sequence << " " << step;
      ASSERT_EQ(grown.high, whole.high) << sequence << " " << step;
      expectSurface(grown, all);
    }
    if (!grown.empty() && sequence % 10 == 0) expectRows(grown);
  }
}

TEST(ConvexHull, GrowingTellsAllRowsThatChange) {
  std::mt19937 rng(5);
  for (int sequence = 0; sequence < 40; ++sequence) {
    HullRows hull = atOnce(some(0, 6, rng));
    if (hull.empty()) continue;
    const HullRows before = hull;
    std::vector<uint8_t> told(hull.low.size(), 0);
    for (const HullRows::Before& row : hull.grow(some(sequence, 10, rng))) {
      told[row.row] = 1;
      EXPECT_EQ(row.low, before.low[row.row]);
      EXPECT_EQ(row.high, before.high[row.row]);
    }
    for (std::size_t row = 0; row < told.size(); ++row)
      if (!told[row]) {
        EXPECT_EQ(hull.low[row], before.low[row]);
        EXPECT_EQ(hull.high[row], before.high[row]);
      }
  }
}

/// A ball's surface: more corners than anything a robot meets.
GridFrame frameOfBall(int radius) {
  const int tiles = radius / fv::kTile + 1;
  return {Voxel::Constant(-tiles * fv::kTile), Voxel::Constant(2 * tiles)};
}
RowExtremes ball(const GridFrame& frame, int radius, int top) {
  const HullRows none(frame);
  RowExtremes out{none.low, none.high};
  for (int z = -radius; z <= std::min(radius, top); ++z)
    for (int y = -radius; y <= radius; ++y) {
      const int rest = radius * radius - y * y - z * z;
      if (rest < 0) continue;
      const std::size_t row = none.row(y, z);
      out.high[row] = static_cast<int>(std::sqrt(rest));
      out.low[row] = -out.high[row];
    }
  return out;
}

TEST(ConvexHull, AGrownBallIsAsMadeAtOnce) {
  constexpr int kRadius = 75;
  const GridFrame frame = frameOfBall(kRadius);
  const RowExtremes all = ball(frame, kRadius, kRadius);
  const HullRows whole = fv::hullOfRows(frame, all);
  for (const int top : {-60, 0, 50, 72}) {  // from few voxels that come new to so many that all begins anew
    HullRows grown = fv::hullOfRows(frame, ball(frame, kRadius, top));
    std::vector<Voxel> added;
    for (int z = top + 1; z <= kRadius; ++z)
      for (int y = -kRadius; y <= kRadius; ++y)
        if (const std::size_t row = grown.row(y, z); all.low[row] <= all.high[row])
          added.insert(added.end(), {Voxel(all.low[row], y, z), Voxel(all.high[row], y, z)});
    grown.grow(added);
    EXPECT_EQ(grown.low, whole.low) << top;
    EXPECT_EQ(grown.high, whole.high) << top;
    EXPECT_EQ(grown.vertices.size(), whole.vertices.size()) << top;
    expectSurface(grown, {});
  }
}

TEST(ConvexHull, TheTimeOfManyCornersIsNotTheirSquare) {
  const auto seconds = [](int radius) {  // of this process: the least of some runs
    const GridFrame frame = frameOfBall(radius);
    const RowExtremes rows = ball(frame, radius, radius);
    double least = 1e9;
    for (int run = 0; run < 4; ++run) {
      const std::clock_t start = std::clock();
      fv::hullOfRows(frame, rows);
      least = std::min(least, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    return least;
  };
  EXPECT_LT(seconds(200), 30 * seconds(50));  // 8 times the corners, 16 times the rows
}

TEST(ConvexHull, VoxelsInAPlaneHaveNone) {
  EXPECT_TRUE(atOnce({}).empty());
  EXPECT_TRUE(atOnce({{1, 2, 3}}).empty());
  EXPECT_TRUE(atOnce({{0, 0, 0}, {5, 0, 0}, {0, 5, 0}, {5, 5, 0}, {2, 3, 0}}).empty());
}

}  // namespace
