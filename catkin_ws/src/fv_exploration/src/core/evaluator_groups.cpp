// The part of Evaluator that brings together what is known of the tiles of a group: what lies within groups
// that did not change need not be looked at again.
#include <algorithm>
#include <numeric>

#include "fv_exploration/evaluator.h"
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

}  // namespace

void Evaluator::refreshGroups(const std::vector<uint8_t>& stale) {
  const std::vector<int> list = marked(stale);
  parallelChunks(static_cast<int>(list.size()), threadCount(config_.threads), 1,
                 [&](int begin, int end, int) {
                   for (int i = begin; i < end; ++i) {
                     Group& group = groups_[list[i]];
                     mergeGroup(group);
                     connectGroup(group);
                     listNeighbours(group);
                   }
                 });
  part_start_.assign(1, 0);
  node_start_.assign(1, 0);
  for (const Group& group : groups_) {
    part_start_.push_back(part_start_.back() + group.parts);
    node_start_.push_back(node_start_.back() + static_cast<int>(group.graph.nodes.size()));
  }
}

/// Merge the void ellipsoids of its tiles.
void Evaluator::mergeGroup(Group& group) {
  int labels = 0;
  bool touched = false;
  for (const int t : group.tiles) {
    first_label_[t] = labels;
    labels += labels_[t];
    touched |= void_touched_[t] != 0;
  }
  if (!touched) return;
  if (!config_.tiled) {  // the labels stand for ellipsoids already
    group.graph.nodes.resize(labels);
    group.node_of.resize(labels);
    std::iota(group.node_of.begin(), group.node_of.end(), 0);
    return;
  }
  VoidGraph all;
  all.nodes.reserve(labels);
  for (const int t : group.tiles) {
    if (labels_[t] == 0) continue;
    const VoidGraph& graph = tiles_[t]->graph;
    all.nodes.insert(all.nodes.end(), graph.nodes.begin(), graph.nodes.end());
    for (const auto& [a, b] : graph.edges) all.edges.emplace_back(first_label_[t] + a, first_label_[t] + b);
  }
  all.settled = all.edges.size();
  for (const int t : group.tiles) {
    if (labels_[t] == 0) continue;
    for (const TileLink& link : tiles_[t]->void_links) {
      const int n = t + step_to_[link.direction];
      if (group_of_[n] == group_of_[t])
        all.edges.emplace_back(first_label_[t] + link.own, first_label_[n] + link.other);
    }
  }
  const VoidGraph before = std::move(group.graph);
  group.graph = mergeNearestFirst(all, rule(), group.node_of);
  fitGroup(group, before);
}

/// The ellipsoids of its nodes, those taken over that were there before.
void Evaluator::fitGroup(Group& group, const VoidGraph& before) {
  std::vector<Ellipsoid> fits;
  fits.reserve(group.graph.nodes.size());
  std::size_t old = 0;
  for (const VoidNode& node : group.graph.nodes) {
    while (old < before.nodes.size() && before.nodes[old].id < node.id) ++old;
    const bool same = old < before.nodes.size() && before.nodes[old] == node;
    fits.push_back(same ? group.fits[old] : fitEllipsoid(node.moments, model()));
  }
  group.fits = std::move(fits);
}

/// Connected parts of the frontier within it, numbered by their first components.
void Evaluator::connectGroup(Group& group) {
  int components = 0;
  for (const int t : group.tiles) {
    first_component_[t] = components;
    components += components_[t];
  }
  UnionFind sets(components);
  for (const int t : group.tiles)
    if (components_[t])
      for (const TileLink& link : tiles_[t]->frontier_links) {
        const int n = t + step_to_[link.direction];
        if (group_of_[n] == group_of_[t])
          sets.unite(first_component_[t] + link.own, first_component_[n] + link.other);
      }
  group.parts = sets.number(group.part_of);
}

/// What its parts and nodes neighbour, within it and beyond.
void Evaluator::listNeighbours(Group& group) {
  group.pairs.clear();
  group.frontiers_across.clear();
  group.voids_across.clear();
  group.pairs_across.clear();
  for (const int t : group.tiles) {
    if (!tiles_[t]) continue;
    const int* parts = group.part_of.data() + first_component_[t];
    const int* nodes = group.node_of.data() + first_label_[t];
    const auto beyond = [&](const TileLink& link, const int* own, std::vector<Across>& out) {
      const int n = t + step_to_[link.direction];
      if (group_of_[n] == group_of_[t]) return false;
      out.push_back({own[link.own], n, link.other});
      return true;
    };
    if (components_[t]) {
      for (const TileLink& link : tiles_[t]->frontier_links) beyond(link, parts, group.frontiers_across);
      for (const TileLink& link : tiles_[t]->frontier_voids)
        if (!beyond(link, parts, group.pairs_across))
          group.pairs.emplace_back(parts[link.own],
                                   group.node_of[first_label_[t + step_to_[link.direction]] + link.other]);
    }
    if (labels_[t])
      for (const TileLink& link : tiles_[t]->void_links) beyond(link, nodes, group.voids_across);
  }
  sortUnique(group.pairs);
  sortUnique(group.voids_across);  // labels of one node see the same
}

}  // namespace fv
