#include "void_join.h"

#include <algorithm>
#include <climits>
#include <numeric>

#include "union_find.h"

namespace fv {

namespace {

/// Nodes that neighbour others of their own group or of another one, and the connected sets of them in which
/// some may merge across groups.
class Concerned {
 public:
  Concerned(const TileGroups& groups, const ClusterRule& rule) : groups_(groups), place_(groups.nodes(), -1) {
    for (int g = 0; g < groups.count(); ++g) {
      const int first = groups.firstNode(g);
      for (const auto& [a, b] : groups.at(g).graph.edges)
        edges_.emplace_back(placeOf(g, first + a), placeOf(g, first + b));
      for (const Across& link : groups.at(g).voids_across) {
        const int own = placeOf(g, first + link.own);
        across_.emplace_back(own, placeOf(groups.groupOf(link.tile), groups.nodeOf(link.tile, link.label)));
      }
    }
    connect(rule);
  }

  /// The connected sets in which two may merge. @param[out] numbers of their nodes among those of all groups.
  VoidGraph graph(std::vector<int>& numbers) const {
    VoidGraph out;
    std::vector<int> rank(nodes_.size(), -1);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (!concerned_[i]) continue;
      rank[i] = static_cast<int>(numbers.size());
      numbers.push_back(numbers_[i]);
      out.nodes.push_back(*nodes_[i]);
    }
    for (const auto& [a, b] : edges_)
      if (concerned_[a]) out.edges.emplace_back(rank[a], rank[b]);
    out.settled = out.edges.size();
    for (const auto& [a, b] : across_)
      if (concerned_[a]) out.edges.emplace_back(rank[a], rank[b]);
    return out;
  }

 private:
  int placeOf(int group, int number) {
    if (place_[number] < 0) {
      place_[number] = static_cast<int>(nodes_.size());
      nodes_.push_back(&groups_.at(group).graph.nodes[number - groups_.firstNode(group)]);
      numbers_.push_back(number);
    }
    return place_[number];
  }

  void connect(const ClusterRule& rule) {
    UnionFind sets(static_cast<int>(nodes_.size()));
    for (const auto& [a, b] : edges_) sets.unite(a, b);
    for (const auto& [a, b] : across_) sets.unite(a, b);
    concerned_.assign(nodes_.size(), 0);
    for (const auto& [a, b] : across_) {
      uint8_t& set = concerned_[sets.find(a)];
      if (!set) set = rule.accepts(nodes_[a]->moments + nodes_[b]->moments);
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i)  // a root is the first of its set
      concerned_[i] = concerned_[sets.find(static_cast<int>(i))];
  }

  const TileGroups& groups_;
  std::vector<int> place_;  // by number: its place in the lists below, -1: in none
  std::vector<const VoidNode*> nodes_;
  std::vector<int> numbers_;
  std::vector<uint8_t> concerned_;
  std::vector<std::pair<int, int>> edges_, across_;
};

}  // namespace

int VoidJoin::update(const TileGroups& groups, const ClusterRule& rule) {
  leader_.resize(groups.nodes());
  std::iota(leader_.begin(), leader_.end(), 0);
  std::vector<int> numbers, merged_into;
  const VoidGraph graph = Concerned(groups, rule).graph(numbers);
  const VoidGraph merged = mergeNearestFirst(graph, rule, merged_into);
  take(numbers, merged, merged_into, rule.model);
  return static_cast<int>(graph.nodes.size());
}

/// @param number_of per node of the graph that was merged, its number among those of all groups.
void VoidJoin::take(const std::vector<int>& number_of, const VoidGraph& merged,
                    const std::vector<int>& merged_into, const EllipsoidModel& model) {
  std::vector<int> leader(merged.nodes.size(), INT_MAX), members(merged.nodes.size(), 0);
  for (std::size_t i = 0; i < number_of.size(); ++i) {
    leader[merged_into[i]] = std::min(leader[merged_into[i]], number_of[i]);
    ++members[merged_into[i]];
  }
  for (std::size_t i = 0; i < number_of.size(); ++i) leader_[number_of[i]] = leader[merged_into[i]];
  std::vector<Joined> joined;
  auto old = joined_.begin();
  for (std::size_t i = 0; i < merged.nodes.size(); ++i) {
    if (members[i] == 1) continue;
    const VoidNode& node = merged.nodes[i];
    while (old != joined_.end() && old->what.id < node.id) ++old;
    const bool same = old != joined_.end() && old->what == node;
    joined.push_back({leader[i], node, same ? old->fit : fitEllipsoid(node.moments, model)});
  }
  joined_ = std::move(joined);
}

std::vector<const Ellipsoid*> VoidJoin::fits(const TileGroups& groups) const {
  std::vector<const Ellipsoid*> fits(groups.nodes(), nullptr);
  for (int g = 0; g < groups.count(); ++g)
    for (std::size_t i = 0; i < groups.at(g).fits.size(); ++i) {
      const int node = groups.firstNode(g) + static_cast<int>(i);
      if (leader_[node] == node) fits[node] = &groups.at(g).fits[i];
    }
  for (const Joined& joined : joined_) fits[joined.node] = &joined.fit;
  return fits;
}

}  // namespace fv
