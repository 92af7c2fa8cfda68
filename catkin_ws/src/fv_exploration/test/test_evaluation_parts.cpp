// The parts of an evaluation, each against what plain loops over the voxels find.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <tuple>

#include "random_walk.h"
#include "union_find.h"
#include "void_join.h"

namespace {

using fv::Voxel;

constexpr int kThreads = 2;

/// The parts of an evaluation that goes along with a walk, and the voxels that they label.
class EvaluationParts : public testing::TestWithParam<int> {
 protected:
  EvaluationParts() : walk_(GetParam()), map_(mapConfig()) {}

  static fv::MapConfig mapConfig() {
    fv::MapConfig config;
    config.resolution_m = 0.05;
    config.prob_hit = 0.8;
    config.prob_miss = 0.2;
    config.bounds_min = {-2.1, -0.9, -1.1};
    config.bounds_max = {2.0, 1.7, 0.8};
    return config;
  }

  void step() {
    walk_.step(map_);
    was_unknown_ = unknown();
    changes_ = classes_.read(map_, hull_, kThreads);
    hull_.note(changes_.ends, classes_.flags());
    std::vector<uint8_t> voids = changes_.voids;
    tiles_.refreshFrontiers(changes_.frontiers, classes_, true, kThreads, [&] { hull_.update(voids); });
    tiles_.refreshVoids(voids, classes_, hull_.hull(), &rule_, kThreads);
    groups_.refresh(tiles_.relink(kThreads), tiles_, &rule_, kThreads);
    frontiers_ = labelled(&fv::Tile::frontier);
    voids_ = labelled(&fv::Tile::voids);
  }

  /// (tile, label) by index of the frame; tile -1: not in it.
  struct Label {
    int tile = -1, label = -1;
    bool operator<(const Label& o) const { return std::tie(tile, label) < std::tie(o.tile, o.label); }
    bool operator==(const Label& o) const { return tile == o.tile && label == o.label; }
  };
  using Labels = std::vector<Label>;
  Labels labelled(fv::LabelledMask fv::Tile::*part) const {
    Labels out(layout_.frame.size());
    for (int t = 0; t < layout_.count(); ++t)
      if (tiles_.at(t))
        fv::forEachLabel(tiles_.at(t)->*part, layout_.corner(t), [&](const Voxel& v, int label) {
          out[layout_.frame.index(v)] = {t, label};
        });
    return out;
  }

  std::vector<uint8_t> unknown() const {
    std::vector<uint8_t> out;
    for (const uint8_t flags : classes_.flags()) out.push_back((flags & fv::kClassMask) == fv::kUnknown);
    return out;
  }

  /// Call visit(index, index of a 26-neighbour) within the frame.
  template <class Visit>
  void forEachNeighbour(std::size_t i, const Visit& visit) const {
    const Voxel v = layout_.frame.voxel(i);
    for (int d = 0; d < 27; ++d) {
      const Voxel n = v + fv::directionStep(d);
      if (d != 13 && layout_.frame.contains(n)) visit(layout_.frame.index(n));
    }
  }

  /// Pairs of labels with neighbouring voxels. @param which (tile, tile) that count.
  template <class Which>
  std::set<std::pair<Label, Label>> touching(const Labels& a, const Labels& b, const Which& which) const {
    std::set<std::pair<Label, Label>> out;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (a[i].tile >= 0)
        forEachNeighbour(i, [&](std::size_t n) {
          if (b[n].tile >= 0 && which(a[i].tile, b[n].tile)) out.emplace(a[i], b[n]);
        });
    return out;
  }

  /// Links of all tiles.
  std::set<std::pair<Label, Label>> linked(std::vector<fv::TileLink> fv::Tile::*list) const {
    std::set<std::pair<Label, Label>> out;
    for (int t = 0; t < layout_.count(); ++t)
      if (tiles_.at(t))
        for (const fv::TileLink& link : tiles_.at(t)->*list)
          out.insert({{t, link.own}, {t + layout_.step_to[link.direction], link.other}});
    return out;
  }

  /// Connected sets of frontier voxels, by index of the frame; neighbours count when which(tile, tile) holds.
  template <class Which>
  fv::UnionFind connected(const Which& which) const {
    fv::UnionFind sets(static_cast<int>(frontiers_.size()));
    for (std::size_t i = 0; i < frontiers_.size(); ++i)
      if (frontiers_[i].tile >= 0)
        forEachNeighbour(i, [&](std::size_t n) {
          if (frontiers_[n].tile >= 0 && which(frontiers_[i].tile, frontiers_[n].tile))
            sets.unite(static_cast<int>(i), static_cast<int>(n));
        });
    return sets;
  }

  /// Expect that number(label) names the sets of frontier voxels, one to one.
  template <class Number>
  void expectNames(fv::UnionFind sets, int count, const Number& number) const {
    std::map<int, int> name_of;
    std::set<int> names;
    for (std::size_t i = 0; i < frontiers_.size(); ++i) {
      if (frontiers_[i].tile < 0) continue;
      const int name = number(frontiers_[i]);
      const auto known = name_of.emplace(sets.find(static_cast<int>(i)), name).first;
      ASSERT_EQ(known->second, name);
      names.insert(name);
    }
    EXPECT_EQ(name_of.size(), names.size());
    EXPECT_EQ(static_cast<int>(names.size()), count);
  }

  Walk walk_;
  fv::OccupancyMap map_;
  fv::ClusterRule rule_{{0.05, false}, std::array<double, 3>{0.9, 0.5, 0.1}[GetParam() % 3]};
  fv::TileLayout layout_{map_.frame()};
  fv::HullTracker hull_{map_.frame()};
  fv::VoxelClasses classes_{map_.classes(), layout_};
  fv::TileStore tiles_{layout_};
  fv::TileGroups groups_{layout_};
  fv::VoxelClasses::Changes changes_;
  std::vector<uint8_t> was_unknown_;
  Labels frontiers_, voids_;
};

TEST_P(EvaluationParts, ClassesAreTheMapsAndTilesWhoseUnknownSpaceChangedAreStale) {
  for (int i = 0; i < 4; ++i) {
    step();
    std::vector<uint8_t> stale(layout_.count(), 0);
    const std::vector<uint8_t> now = unknown();
    for (std::size_t v = 0; v < now.size(); ++v) {
      ASSERT_EQ(classes_.flags()[v] & fv::kClassMask, map_.classes()[v]);
      if (now[v] != was_unknown_[v]) stale[layout_.frame.tileOf(layout_.frame.voxel(v))] = 1;
    }
    EXPECT_EQ(changes_.voids, stale);
  }
}

TEST_P(EvaluationParts, FrontiersAndVoidsAreWhatTheirDefinitionsSay) {
  for (int i = 0; i < 4; ++i) {
    step();
    int64_t frontiers = 0, voids = 0;
    for (std::size_t v = 0; v < frontiers_.size(); ++v) {
      const uint8_t own = map_.classes()[v];
      bool beside_unknown = false;
      forEachNeighbour(v, [&](std::size_t n) { beside_unknown |= map_.classes()[n] == fv::kUnknown; });
      const bool frontier = own == fv::kFree && beside_unknown;
      const bool is_void = own == fv::kUnknown && hull_.hull().contains(layout_.frame.voxel(v));
      ASSERT_EQ(frontiers_[v].tile >= 0, frontier);
      ASSERT_EQ(voids_[v].tile >= 0, is_void);
      ASSERT_EQ((classes_.flags()[v] & fv::kFrontierFlag) != 0, frontier);
      ASSERT_EQ((classes_.flags()[v] & fv::kVoidFlag) != 0, is_void);
      frontiers += frontier;
      voids += is_void;
    }
    EXPECT_EQ(tiles_.frontierVoxels(), frontiers);
    EXPECT_EQ(tiles_.voidVoxels(), voids);
  }
  EXPECT_GT(tiles_.voidVoxels(), 1000);
}

TEST_P(EvaluationParts, LabelsOfTilesAreLinkedWhereTheirVoxelsTouch) {
  const auto ahead = [](int tile, int other) { return tile < other; };
  for (int i = 0; i < 3; ++i) {
    step();
    int components = 0;
    for (int t = 0; t < layout_.count(); ++t) components += tiles_.components(t);
    expectNames(connected([](int tile, int other) { return tile == other; }), components,
                [&](const Label& l) { return l.tile * fv::kTileVoxels + l.label; });
    EXPECT_EQ(linked(&fv::Tile::frontier_links), touching(frontiers_, frontiers_, ahead));
    EXPECT_EQ(linked(&fv::Tile::void_links), touching(voids_, voids_, ahead));
    EXPECT_EQ(linked(&fv::Tile::frontier_voids), touching(frontiers_, voids_, [](int, int) { return true; }));
  }
}

TEST_P(EvaluationParts, GroupsHoldWhatIsConnectedWithinThem) {
  const auto same_group = [&](int a, int b) { return layout_.sameGroup(a, b); };
  for (int i = 0; i < 3; ++i) {
    step();
    expectNames(connected(same_group), groups_.parts(),
                [&](const Label& l) { return groups_.partOf(l.tile, l.label); });
    std::set<std::pair<int, int>> pairs, listed;
    for (const auto& [a, b] : touching(frontiers_, voids_, same_group))
      pairs.emplace(groups_.partOf(a.tile, a.label), groups_.nodeOf(b.tile, b.label));
    for (int g = 0; g < groups_.count(); ++g)
      for (const auto& [part, node] : groups_.at(g).pairs)
        listed.emplace(groups_.firstPart(g) + part, groups_.firstNode(g) + node);
    EXPECT_EQ(listed, pairs);
  }
}

TEST_P(EvaluationParts, NodesOfGroupsStandForTheirVoids) {
  for (int i = 0; i < 3; ++i) step();
  std::vector<fv::Moments> moments(groups_.nodes());
  for (std::size_t v = 0; v < voids_.size(); ++v)
    if (voids_[v].tile >= 0)
      moments[groups_.nodeOf(voids_[v].tile, voids_[v].label)].add(layout_.frame.voxel(v));
  for (int g = 0; g < groups_.count(); ++g)
    for (std::size_t n = 0; n < groups_.at(g).graph.nodes.size(); ++n) {
      const fv::VoidNode& node = groups_.at(g).graph.nodes[n];
      EXPECT_EQ(node.moments, moments[groups_.firstNode(g) + n]);
      EXPECT_EQ(groups_.at(g).fits[n].center, fv::fitEllipsoid(node.moments, rule_.model).center);
    }
}

TEST_P(EvaluationParts, FrontiersOfAllGroupsAreConnected) {
  for (int i = 0; i < 3; ++i) {
    step();
    std::vector<int> cluster_of;
    const int clusters = groups_.connectFrontiers(cluster_of);
    expectNames(connected([](int, int) { return true; }), clusters,
                [&](const Label& l) { return cluster_of[groups_.partOf(l.tile, l.label)]; });
  }
}

/// Merging all nodes of all groups, those too that have nobody to merge with.
TEST_P(EvaluationParts, VoidsThatMayMergeAcrossGroupsAreFound) {
  fv::VoidJoin join;
  int looked_at = 0;
  for (int i = 0; i < 4; ++i) {
    step();
    looked_at += join.update(groups_, rule_);
    fv::VoidGraph all;
    for (int g = 0; g < groups_.count(); ++g) {
      const fv::TileGroup& group = groups_.at(g);
      all.nodes.insert(all.nodes.end(), group.graph.nodes.begin(), group.graph.nodes.end());
      for (const auto& [a, b] : group.graph.edges)
        all.edges.emplace_back(groups_.firstNode(g) + a, groups_.firstNode(g) + b);
      for (const fv::Across& link : group.voids_across)
        all.edges.emplace_back(groups_.firstNode(g) + link.own, groups_.nodeOf(link.tile, link.label));
    }
    std::vector<int> merged_into, first(groups_.nodes(), -1);
    const fv::VoidGraph merged = fv::mergeNearestFirst(all, rule_, merged_into);
    const std::vector<const fv::Ellipsoid*> fits = join.fits(groups_);
    for (int node = 0; node < groups_.nodes(); ++node) {
      int& leader = first[merged_into[node]];
      if (leader < 0) leader = node;
      ASSERT_EQ(join.leader()[node], leader) << "node " << node;
      ASSERT_EQ(fits[node] != nullptr, node == leader);
      if (node == leader) {
        EXPECT_EQ(fits[node]->count, merged.nodes[merged_into[node]].moments.n);
      }
    }
  }
  if (rule_.min_fit < 0.6) {
    EXPECT_GT(looked_at, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Walks, EvaluationParts, testing::Range(0, 6));

}  // namespace
