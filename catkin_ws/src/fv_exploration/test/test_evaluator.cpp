// An evaluation that went along with a map against a new one, where the sanitizers see both; what is right is
// for test_evaluation.py to say.
#include <gtest/gtest.h>

#include "convex_hull.h"
#include "fv_exploration/evaluator.h"
#include "random_walk.h"

namespace {

using fv::Voxel;

/// Frontiers and voids with their labels, one after the other.
std::pair<std::vector<Voxel>, std::vector<int>> listed(const fv::Evaluator& evaluator) {
  std::pair<std::vector<Voxel>, std::vector<int>> out;
  evaluator.frontier(out.first, out.second);
  evaluator.voids(out.first, out.second);
  return out;
}

void expectSame(const fv::Evaluator& a, const fv::Evaluator& b) {
  EXPECT_EQ(listed(a), listed(b));
  EXPECT_EQ(a.flags(), b.flags());
  EXPECT_EQ(a.hull().low, b.hull().low);
  EXPECT_EQ(a.hull().high, b.hull().high);
  const fv::Evaluation &one = a.evaluation(), &other = b.evaluation();
  EXPECT_EQ(one.clusters, other.clusters);
  EXPECT_EQ(one.neighbour_clusters, other.neighbour_clusters);
  ASSERT_EQ(one.ellipsoids.size(), other.ellipsoids.size());
  for (std::size_t i = 0; i < one.ellipsoids.size(); ++i) {
    EXPECT_EQ(one.ellipsoids[i].center, other.ellipsoids[i].center);
    EXPECT_EQ(one.ellipsoids[i].semi_axes, other.ellipsoids[i].semi_axes);
    EXPECT_EQ(one.ellipsoids[i].axes, other.ellipsoids[i].axes);
  }
}

TEST(Evaluator, GoneAlongIsAsNew) {
  for (int seed = 0; seed < 24; ++seed) {
    Walk walk(seed);
    fv::MapConfig made;
    made.resolution_m = 0.1;
    made.prob_hit = 0.8;
    made.prob_miss = 0.2;
    if (walk.coin()) {
      made.bounds_min = {-1.3, -0.9, -1.1};
      made.bounds_max = {1.2, 1.7, 0.8};
    }
    fv::EvaluationConfig config;
    config.min_fit = std::array<double, 4>{1.0, 0.9, 0.5, 0.1}[seed % 4];
    config.seed_share = std::array<double, 3>{0.0, 1.0, 1.0 / 27}[seed % 3];
    config.literal_formula = walk.coin();
    config.tiled = seed % 5 > 0;
    config.threads = 1 + seed % 4;
    fv::OccupancyMap map(made);
    fv::Evaluator along(map, config);
    for (int step = 0; step < 5; ++step) {
      walk.step(map);
      along.update();
      fv::Evaluator anew(map, config);
      anew.update();
      expectSame(along, anew);
      ASSERT_FALSE(HasFailure()) << "seed " << seed << ", step " << step;
    }
  }
}

}  // namespace
