// The fast insertion against OctoMap's own, and what happens to bad input.
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <random>
#include <set>

#include "fv_exploration/occupancy_map.h"

namespace {

using fv::OccupancyMap;
using fv::Points;
using octomap::OcTree;
using octomap::point3d;

struct Case {
  double resolution_m;
  double max_range_m;
  int points;
  bool dense;
  int threads;
};

std::unique_ptr<OcTree> referenceTree(const fv::MapConfig& c) {
  auto tree = std::make_unique<OcTree>(c.resolution_m);
  tree->setProbHit(c.prob_hit);
  tree->setProbMiss(c.prob_miss);
  tree->setClampingThresMin(c.clamp_min);
  tree->setClampingThresMax(c.clamp_max);
  tree->setOccupancyThres(c.occupancy_threshold);
  return tree;
}

/// A scan of a box-like room from inside; some points on voxel borders, some in the sensor's own voxel.
std::vector<point3d> scan(std::mt19937& random, const point3d& origin, int count, double resolution) {
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform(0.F, 1.F);
  std::vector<point3d> out;
  for (int i = 0; i < count; ++i) {
    point3d d(normal(random), normal(random), normal(random));
    d.normalize();
    const float kind = uniform(random);
    if (kind < 0.1F)
      d = point3d(kind < 0.05F ? 1.F : 0.F, kind < 0.03F ? -1.F : 1.F, 0.F);  // axes and diagonals
    point3d p = origin + d * (kind > 0.98F ? 0.01F : 0.5F + 1.5F * uniform(random));
    if (kind > 0.9F && kind < 0.95F)
      for (int axis = 0; axis < 3; ++axis)
        p(axis) = static_cast<float>(std::round(p(axis) / resolution) * resolution);
    out.push_back(p);
  }
  return out;
}

/// Every node of both trees, pruned alike and with the same bits.
void expectSameTree(const OcTree& a, const OcTree& b) {
  ASSERT_EQ(a.size(), b.size());
  auto i = a.begin_tree();
  for (auto j = b.begin_tree(); j != b.end_tree(); ++i, ++j) {
    ASSERT_EQ(i.getKey(), j.getKey());
    ASSERT_EQ(i.getDepth(), j.getDepth());
    ASSERT_EQ(i->getLogOdds(), j->getLogOdds());
  }
}

/// The grid of classes says what the tree says.
void expectSameClasses(const OccupancyMap& map) {
  std::array<int64_t, 4> counts{};
  for (std::size_t i = 0; i < map.classes().size(); ++i) {
    const fv::Voxel v = map.frame().voxel(i);
    const auto* node = map.tree().search(map.tree().key(v));
    const fv::Class expected = node                                         ? map.tree().classOf(node)
                               : map.bounded() && !map.bounds().contains(v) ? fv::kOutside
                                                                            : fv::kUnknown;
    ASSERT_EQ(map.classes()[i], expected);
    ++counts[expected];
  }
  EXPECT_EQ(map.count(fv::kFree), counts[fv::kFree]);
  EXPECT_EQ(map.count(fv::kOccupied), counts[fv::kOccupied]);
}

class Insertion : public testing::TestWithParam<Case> {};

TEST_P(Insertion, IsThatOfInsertPointCloud) {
  const Case c = GetParam();
  fv::MapConfig config;
  config.resolution_m = c.resolution_m;
  config.threads = c.threads;
  config.dense_limit_mb = c.dense ? 512 : 0;
  OccupancyMap map(config);
  const auto reference = referenceTree(config);
  std::mt19937 random(7);
  for (int k = 0; k < 6; ++k) {
    const point3d origin(0.31F * k, k == 2 ? 0.F : -0.17F * k, 0.05F * k);
    const std::vector<point3d> points = scan(random, origin, c.points, c.resolution_m);
    octomap::Pointcloud cloud;
    for (const point3d& p : points) cloud.push_back(p);
    reference->insertPointCloud(cloud, origin, c.max_range_m, false, false);
    map.insertRays({origin, points, {}}, c.max_range_m);
    expectSameTree(map.tree(), *reference);
  }
  expectSameClasses(map);
}

TEST(HugeClouds, TenMillionPointsAreInsertedAsByOctoMap) {
  const fv::MapConfig config = [] {
    fv::MapConfig c;
    c.resolution_m = 0.2;
    return c;
  }();
  OccupancyMap map(config);
  const auto reference = referenceTree(config);
  std::mt19937 random(11);
  const point3d origin(0.1F, 0.2F, 0.3F);
  const std::vector<point3d> points = scan(random, origin, 10'000'000, config.resolution_m);
  octomap::Pointcloud cloud;
  cloud.reserve(points.size());
  for (const point3d& p : points) cloud.push_back(p);
  reference->insertPointCloud(cloud, origin, 1.0, false, false);
  map.insertRays({origin, points, {}}, 1.0);
  expectSameTree(map.tree(), *reference);
}

INSTANTIATE_TEST_SUITE_P(Sizes, Insertion,
                         testing::Values(Case{0.05, -1, 3000, true, 2}, Case{0.05, -1, 3000, true, 1},
                                         Case{0.05, 1.2, 3000, true, 2}, Case{0.05, 1.2, 2000, false, 2},
                                         Case{0.01, -1, 300, true, 2}, Case{0.01, 0.9, 200, false, 2},
                                         Case{0.2, -1, 3000, true, 3}, Case{0.1, 0.9, 1, true, 2}));

TEST(Insertion, InsideBoundsIsTheUnboundedResultCut) {
  fv::MapConfig config;
  config.bounds_min = {-0.6, -0.52, -0.3};
  config.bounds_max = {0.8, 0.7, 0.9};
  OccupancyMap map(config);
  const auto reference = referenceTree(config);
  std::mt19937 random(3);
  for (int k = 0; k < 4; ++k) {
    const point3d origin(-1.F + 0.4F * k, 0.1F, 0.2F);
    const std::vector<point3d> points = scan(random, origin, 2000, config.resolution_m);
    octomap::Pointcloud cloud;
    for (const point3d& p : points) cloud.push_back(p);
    reference->insertPointCloud(cloud, origin, -1, false, false);
    map.insertRays({origin, points, {}}, -1);
  }
  expectSameClasses(map);
  int64_t differing = 0;
  const fv::VoxelBox& b = map.bounds();
  for (int z = b.min.z(); z <= b.max.z(); ++z)
    for (int y = b.min.y(); y <= b.max.y(); ++y)
      for (int x = b.min.x(); x <= b.max.x(); ++x) {
        const auto key = map.tree().key({x, y, z});
        const auto *ours = map.tree().search(key), *theirs = reference->search(key);
        differing +=
            (ours == nullptr) != (theirs == nullptr) || (ours && ours->getLogOdds() != theirs->getLogOdds());
      }
  EXPECT_EQ(differing, 0);
  EXPECT_GT(map.count(fv::kOccupied), 100);
}

TEST(Insertion, ClearedRaysAreFreeUpToTheirEnd) {
  OccupancyMap map(fv::MapConfig{});
  map.insertRays({point3d(0.01F, 0.01F, 0.01F), {}, {point3d(1.01F, 0.01F, 0.01F)}}, -1);
  EXPECT_EQ(map.count(fv::kOccupied), 0);
  EXPECT_EQ(map.count(fv::kFree), 20);
}

TEST(Insertion, RowsWithoutReturnClearOnlyWhenAsked) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Points points(2, 3), directions(2, 3);
  points << nan, nan, nan, nan, 0, 0;
  directions << 0, 0, 2, 1, 0, 0;
  for (const double clear_m : {0.0, 1.0}) {
    OccupancyMap map(fv::MapConfig{});
    const fv::InsertResult r =
        map.insertScan(points, Eigen::Matrix4d::Identity(), {0.0, 3.0, clear_m}, directions);
    EXPECT_EQ(r.counts.at("rays"), clear_m > 0 ? 2 : 0);
    EXPECT_EQ(map.count(fv::kFree) > 30, clear_m > 0);
    EXPECT_EQ(map.sequence(), 1U);
  }
}

TEST(Insertion, EmptyCloudsAndCloudsOfNaNChangeNothingButTheSequence) {
  OccupancyMap map(fv::MapConfig{});
  map.insertScan(Points(0, 3), Eigen::Matrix4d::Identity(), {}, Points(0, 3));
  map.insertScan(Points::Constant(5, 3, std::nan("")), Eigen::Matrix4d::Identity(), {}, Points(0, 3));
  EXPECT_EQ(map.tree().size(), 0U);
  EXPECT_EQ(map.sequence(), 2U);
}

TEST(Insertion, NearReturnsAreDroppedWithTheirRay) {
  OccupancyMap map(fv::MapConfig{});
  Points p(1, 3);
  p << 0.2, 0, 0;
  EXPECT_EQ(
      map.insertScan(p, Eigen::Matrix4d::Identity(), {0.3, 3.0, 0.0}, Points(0, 3)).counts.at("dropped"), 1);
  EXPECT_EQ(map.count(fv::kFree), 0);
}

/// Points of every size that a number can have, up to `most_exponent` decimal digits before the point.
Points anyPoints(std::mt19937& random, int count, double most_exponent) {
  std::uniform_real_distribution<double> exponent(-320, most_exponent);
  std::uniform_int_distribution<int> kind(0, 9);
  Points out(count, 3);
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const int k = kind(random);
    const double size = k < 4 ? std::pow(10, exponent(random)) : k < 7 ? 0.5 * k : k < 8 ? 0.0 : 1e-29;
    out.data()[i] = k % 2 ? size : -size;
  }
  return out;
}

TEST(Insertion, PointsThatNoSensorSeesAreDroppedAndCounted) {
  std::mt19937 random(9);
  for (const bool dense : {true, false})
    for (const double shift : {0.0, 0.05, 1600.0}) {
      fv::MapConfig config;
      config.dense_limit_mb = dense ? 64 : 0;
      OccupancyMap map(config), sane(config);
      const Points points = anyPoints(random, 400, 300);
      Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
      T(0, 3) = shift;
      int64_t absurd = 0;
      Points kept(points.rows(), 3);
      Eigen::Index rows = 0;
      for (Eigen::Index i = 0; i < points.rows(); ++i) {
        const double range = points.row(i).stableNorm();
        if (range < fv::kNearestReturn || range > fv::kFarthestReturn)
          ++absurd;
        else
          kept.row(rows++) = points.row(i);
      }
      const auto counts = map.insertScan(points, T, {0.0, 5.0, 0.0}, Points(0, 3)).counts;
      sane.insertScan(kept.topRows(rows), T, {0.0, 5.0, 0.0}, Points(0, 3));
      EXPECT_EQ(counts.at("absurd"), absurd);
      EXPECT_GT(absurd, 50);
      EXPECT_EQ(counts.at("dropped"), absurd);
      EXPECT_EQ(counts.at("hits") + counts.at("far"), rows);
      expectSameTree(map.tree(), sane.tree());
    }
}

TEST(Insertion, RaysWithoutLengthMarkTheirEndOnly) {
  OccupancyMap map(fv::MapConfig{});
  const float tiny = 1e-29F;
  map.insertRays({point3d(0, 0, 0), {point3d(-tiny, tiny, 0)}, {point3d(tiny, -tiny, -tiny)}}, -1);
  EXPECT_EQ(map.count(fv::kOccupied), 1);
  EXPECT_EQ(map.count(fv::kFree), 0);
}

TEST(Insertion, RaysThatEndBeyondTheKeysAreCounted) {
  for (const bool dense : {true, false}) {
    fv::MapConfig config;
    config.resolution_m = 0.001;  // reaches 32.768 m
    config.dense_limit_mb = dense ? 512 : 0;
    OccupancyMap map(config);
    Points p(3, 3);
    p << 0.1, 0, 0, 40, 0, 0, 0, 0, 90;
    const auto counts = map.insertScan(p, Eigen::Matrix4d::Identity(), {}, Points(0, 3)).counts;
    EXPECT_EQ(counts.at("outside"), 2);
    EXPECT_EQ(counts.at("hits"), 1);
    EXPECT_EQ(map.count(fv::kOccupied), 1);
  }
}

TEST(BadInput, SensorsBeyondTheKeysAreNamedWithTheShiftTheyNeed) {
  OccupancyMap map(fv::MapConfig{});
  Points p(1, 3);
  p << 1, 0, 0;
  for (const double away : {1638.5, 382000.25, 1e30, 1e300}) {
    Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
    T(1, 3) = -away;
    EXPECT_THROW(map.insertScan(p, T, {}, Points(0, 3)), fv::OutsideKeysError);
  }
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topRightCorner<3, 1>() << 382000.25, 5621000.5, 112;
  try {
    map.insertScan(p, T, {}, Points(0, 3));
  } catch (const fv::OutsideKeysError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("(382000.25, 5621000.5, 112)"), std::string::npos) << text;
    EXPECT_NE(text.find("1638.4 m"), std::string::npos) << text;
    EXPECT_NE(text.find("(-382000, -5621001, -112)"), std::string::npos) << text;
  }
  EXPECT_EQ(map.sequence(), 0U);
}

TEST(Insertion, ReportsExactlyTheVoxelsThatChanged) {
  OccupancyMap map(fv::MapConfig{});
  std::mt19937 random(5);
  std::vector<uint8_t> before;
  for (int k = 0; k < 5; ++k) {
    const point3d origin(0.1F * k, 0, 0);
    OccupancyMap old(map);
    const fv::InsertResult r = map.insertRays({origin, scan(random, origin, 400, 0.05), {}}, -1);
    std::set<uint64_t> seen;
    for (const fv::Change& c : r.changes) {
      EXPECT_TRUE(seen.insert(fv::voxelId(c.voxel)).second);
      EXPECT_EQ(old.classOf(c.voxel), c.before);
      EXPECT_EQ(map.classOf(c.voxel), c.after);
      EXPECT_NE(c.before, c.after);
    }
    int64_t differing = 0;
    for (std::size_t i = 0; i < map.classes().size(); ++i)
      differing += map.classes()[i] != old.classOf(map.frame().voxel(i));
    EXPECT_EQ(differing, static_cast<int64_t>(seen.size()));
  }
}

TEST(BadInput, LeavesTheMapAsItWas) {
  OccupancyMap map(fv::MapConfig{});
  Points p(1, 3);
  p << 1, 0, 0;
  Eigen::Matrix4d skewed = Eigen::Matrix4d::Identity(), lost = skewed, mirrored = skewed;
  skewed(0, 1) = 0.1;
  lost(0, 3) = std::nan("");
  mirrored(0, 0) = -1;
  for (const Eigen::Matrix4d& T : {skewed, lost, mirrored})
    EXPECT_THROW(map.insertScan(p, T, {}, Points(0, 3)), fv::InputError);
  EXPECT_THROW(map.insertScan(p, Eigen::Matrix4d::Identity(), {1.0, 0.5, 0.0}, Points(0, 3)), fv::InputError);
  EXPECT_THROW(map.insertScan(p, Eigen::Matrix4d::Identity(), {}, Points(2, 3)), fv::InputError);
  EXPECT_EQ(map.sequence(), 0U);
  EXPECT_EQ(map.tree().size(), 0U);
}

TEST(BadInput, ConfigurationsNameTheirValue) {
  fv::MapConfig inside_out;
  inside_out.bounds_min = {0, 0, 0};
  inside_out.bounds_max = {1, -1, 1};
  EXPECT_THROW(OccupancyMap{inside_out}, fv::InputError);
  fv::MapConfig flat;
  flat.resolution_m = 0;
  EXPECT_THROW(OccupancyMap{flat}, fv::InputError);
  fv::MapConfig vast;
  vast.resolution_m = 0.001;
  vast.bounds_min = {-10, -10, -10};
  vast.bounds_max = {10, 10, 10};
  EXPECT_THROW(OccupancyMap{vast}, fv::InputError);
}

TEST(MarkFree, MakesVoxelsFreeAndCertain) {
  OccupancyMap map(fv::MapConfig{});
  map.insertRays({point3d(0, 0, 0), {point3d(1.01F, 0.01F, 0.01F)}, {}}, -1);
  Points p(3, 3);
  p << 1.01, 0.01, 0.01, 0.5, 0.51, 0.5, std::nan(""), 0, 0;
  const fv::InsertResult r = map.markFree(p);
  EXPECT_EQ(r.changes.size(), 2U);
  EXPECT_EQ(map.count(fv::kOccupied), 0);
  expectSameClasses(map);
}

}  // namespace
