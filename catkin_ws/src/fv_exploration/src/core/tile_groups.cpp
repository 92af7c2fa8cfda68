#include "tile_groups.h"

#include <algorithm>
#include <numeric>

#include "marked_tiles.h"
#include "parallel.h"
#include "union_find.h"

namespace fv {

namespace {

template <class T>
void sortUnique(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

/// The ellipsoids of nodes, those taken over that were there before; both ascend by id.
std::vector<Ellipsoid> fitNodes(const VoidGraph& now, const VoidGraph& before,
                                const std::vector<Ellipsoid>& fits_before, const EllipsoidModel& model) {
  std::vector<Ellipsoid> fits;
  fits.reserve(now.nodes.size());
  std::size_t old = 0;
  for (const VoidNode& node : now.nodes) {
    while (old < before.nodes.size() && before.nodes[old].id < node.id) ++old;
    const bool same = old < before.nodes.size() && before.nodes[old] == node;
    fits.push_back(same ? fits_before[old] : fitEllipsoid(node.moments, model));
  }
  return fits;
}

}  // namespace

TileGroups::TileGroups(const TileLayout& layout)
    : layout_(layout),
      groups_(layout.groups.size()),
      first_component_(layout.count(), 0),
      first_label_(layout.count(), 0) {}

void TileGroups::refresh(const std::vector<uint8_t>& stale, const TileStore& tiles, const ClusterRule* rule,
                         int threads) {
  const std::vector<int> list = marked(stale);
  parallelChunks(static_cast<int>(list.size()), threads, 1, [&](int begin, int end, int) {
    for (int i = begin; i < end; ++i) {
      mergeVoids(list[i], tiles, rule);
      connectFrontier(list[i], tiles);
      listNeighbours(list[i], tiles);
    }
  });
  part_start_.assign(1, 0);
  node_start_.assign(1, 0);
  for (const TileGroup& group : groups_) {
    part_start_.push_back(part_start_.back() + group.parts);
    node_start_.push_back(node_start_.back() + static_cast<int>(group.graph.nodes.size()));
  }
}

/// Merge the void ellipsoids of its tiles.
void TileGroups::mergeVoids(int g, const TileStore& tiles, const ClusterRule* rule) {
  TileGroup& group = groups_[g];
  int labels = 0;
  bool touched = false;
  for (const int t : layout_.groups[g]) {
    first_label_[t] = labels;
    labels += tiles.labels(t);
    touched |= tiles.voidsTouched(t);
  }
  if (!touched) return;
  if (!rule) {
    group.graph.nodes.resize(labels);
    group.node_of.resize(labels);
    std::iota(group.node_of.begin(), group.node_of.end(), 0);
    return;
  }
  const VoidGraph before = std::move(group.graph);
  group.graph = mergeNearestFirst(voidsOf(g, labels, tiles), *rule, group.node_of);
  group.fits = fitNodes(group.graph, before, group.fits, rule->model);
}

/// The graphs of its tiles as one, with the edges between them.
VoidGraph TileGroups::voidsOf(int g, int labels, const TileStore& tiles) const {
  VoidGraph all;
  all.nodes.reserve(labels);
  for (const int t : layout_.groups[g]) {
    if (tiles.labels(t) == 0) continue;
    const VoidGraph& graph = tiles.at(t)->graph;
    all.nodes.insert(all.nodes.end(), graph.nodes.begin(), graph.nodes.end());
    for (const auto& [a, b] : graph.edges) all.edges.emplace_back(first_label_[t] + a, first_label_[t] + b);
  }
  all.settled = all.edges.size();
  for (const int t : layout_.groups[g]) {
    if (tiles.labels(t) == 0) continue;
    for (const TileLink& link : tiles.at(t)->void_links) {
      const int n = t + layout_.step_to[link.direction];
      if (layout_.sameGroup(t, n))
        all.edges.emplace_back(first_label_[t] + link.own, first_label_[n] + link.other);
    }
  }
  return all;
}

/// Connected parts of the frontier within it, numbered by their first components.
void TileGroups::connectFrontier(int g, const TileStore& tiles) {
  int components = 0;
  for (const int t : layout_.groups[g]) {
    first_component_[t] = components;
    components += tiles.components(t);
  }
  UnionFind sets(components);
  for (const int t : layout_.groups[g])
    if (tiles.components(t))
      for (const TileLink& link : tiles.at(t)->frontier_links) {
        const int n = t + layout_.step_to[link.direction];
        if (layout_.sameGroup(t, n))
          sets.unite(first_component_[t] + link.own, first_component_[n] + link.other);
      }
  groups_[g].parts = sets.number(groups_[g].part_of);
}

/// What its parts and nodes neighbour, within it and beyond.
void TileGroups::listNeighbours(int g, const TileStore& tiles) {
  TileGroup& group = groups_[g];
  group.pairs.clear();
  group.frontiers_across.clear();
  group.voids_across.clear();
  group.pairs_across.clear();
  for (const int t : layout_.groups[g]) {
    if (!tiles.at(t)) continue;
    const int* parts = group.part_of.data() + first_component_[t];
    const int* nodes = group.node_of.data() + first_label_[t];
    const auto beyond = [&](const TileLink& link, const int* own, std::vector<Across>& out) {
      const int n = t + layout_.step_to[link.direction];
      if (layout_.sameGroup(t, n)) return false;
      out.push_back({own[link.own], n, link.other});
      return true;
    };
    if (tiles.components(t)) {
      for (const TileLink& link : tiles.at(t)->frontier_links) beyond(link, parts, group.frontiers_across);
      for (const TileLink& link : tiles.at(t)->frontier_voids)
        if (!beyond(link, parts, group.pairs_across)) {
          const int n = t + layout_.step_to[link.direction];
          group.pairs.emplace_back(parts[link.own], group.node_of[first_label_[n] + link.other]);
        }
    }
    if (tiles.labels(t))
      for (const TileLink& link : tiles.at(t)->void_links) beyond(link, nodes, group.voids_across);
  }
  sortUnique(group.pairs);
  sortUnique(group.voids_across);  // labels of one node see the same
}

int TileGroups::connectFrontiers(std::vector<int>& cluster_of) const {
  UnionFind sets(parts());
  for (int g = 0; g < count(); ++g)
    for (const Across& link : groups_[g].frontiers_across)
      sets.unite(part_start_[g] + link.own, partOf(link.tile, link.label));
  return sets.number(cluster_of);
}

}  // namespace fv
