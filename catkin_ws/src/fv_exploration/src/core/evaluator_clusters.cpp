// The part of Evaluator that makes clusters of what groups of tiles hold: frontiers by union-find, voids by
// merging, and their neighbourhoods.
#include <algorithm>
#include <climits>
#include <numeric>

#include "fv_exploration/evaluator.h"
#include "union_find.h"

namespace fv {

namespace {

/// Indices of the ellipsoids that there are, largest count first, ties by index.
std::vector<int> largestFirst(const std::vector<const Ellipsoid*>& fits) {
  constexpr int64_t kMany = 4096;  // most counts are below it: sorted by counting
  std::vector<std::pair<int64_t, int>> large;
  std::vector<int> end(kMany + 1, 0);
  for (int i = 0; i < static_cast<int>(fits.size()); ++i) {
    if (!fits[i]) continue;
    if (fits[i]->count >= kMany)
      large.emplace_back(-fits[i]->count, i);
    else
      ++end[kMany - fits[i]->count];
  }
  std::sort(large.begin(), large.end());
  std::vector<int> order;
  for (const auto& [count, i] : large) order.push_back(i);
  end[0] = static_cast<int>(large.size());
  std::partial_sum(end.begin(), end.end(), end.begin());
  order.resize(end.back());
  for (int i = 0; i < static_cast<int>(fits.size()); ++i)
    if (fits[i] && fits[i]->count < kMany) order[end[kMany - fits[i]->count - 1]++] = i;
  return order;
}

}  // namespace

/// Nodes that neighbour others of their own group or of another one, and the connected sets of them in which
/// some may merge across groups.
class Evaluator::Concerned {
 public:
  explicit Concerned(const Evaluator& e) : place_(e.node_start_.back(), -1) {
    for (std::size_t g = 0; g < e.groups_.size(); ++g) {
      const Group& group = e.groups_[g];
      for (const auto& [a, b] : group.graph.edges) edges_.emplace_back(placeOf(e, g, a), placeOf(e, g, b));
      for (const Across& link : group.voids_across) {
        const int other = e.group_of_[link.tile];
        const int node = e.groups_[other].node_of[e.first_label_[link.tile] + link.label];
        across_.emplace_back(placeOf(e, g, link.own), placeOf(e, other, node));
      }
    }
    connect(e);
  }

  /// Number of each node of the graph among those of all groups.
  const std::vector<int>& numbers() const { return numbers_; }

  /// The connected sets in which two may merge.
  void take(VoidGraph& graph) {
    std::vector<int> rank(nodes_.size(), -1), numbers;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (!concerned_[i]) continue;
      rank[i] = static_cast<int>(numbers.size());
      numbers.push_back(numbers_[i]);
      graph.nodes.push_back(*nodes_[i]);
    }
    for (const auto& [a, b] : edges_)
      if (concerned_[a]) graph.edges.emplace_back(rank[a], rank[b]);
    graph.settled = graph.edges.size();
    for (const auto& [a, b] : across_)
      if (concerned_[a]) graph.edges.emplace_back(rank[a], rank[b]);
    numbers_ = std::move(numbers);
  }

 private:
  int placeOf(const Evaluator& e, std::size_t group, int node) {
    const int number = e.node_start_[group] + node;
    if (place_[number] < 0) {
      place_[number] = static_cast<int>(nodes_.size());
      nodes_.push_back(&e.groups_[group].graph.nodes[node]);
      numbers_.push_back(number);
    }
    return place_[number];
  }

  void connect(const Evaluator& e) {
    UnionFind sets(static_cast<int>(nodes_.size()));
    for (const auto& [a, b] : edges_) sets.unite(a, b);
    for (const auto& [a, b] : across_) sets.unite(a, b);
    concerned_.assign(nodes_.size(), 0);
    for (const auto& [a, b] : across_) {
      uint8_t& set = concerned_[sets.find(a)];
      if (!set) set = ellipsoidFit(nodes_[a]->moments + nodes_[b]->moments, e.model()) >= e.config_.min_fit;
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i)  // a root is the first of its set
      concerned_[i] = concerned_[sets.find(static_cast<int>(i))];
  }

  std::vector<int> place_;  // by number: its place in the lists below, -1: in none
  std::vector<const VoidNode*> nodes_;
  std::vector<int> numbers_;
  std::vector<uint8_t> concerned_;
  std::vector<std::pair<int, int>> edges_, across_;
};

void Evaluator::numberFrontiers() {
  UnionFind sets(part_start_.back());
  for (std::size_t g = 0; g < groups_.size(); ++g)
    for (const Across& link : groups_[g].frontiers_across)
      sets.unite(part_start_[g] + link.own, partOf(link.tile, link.label));
  evaluation_->clusters = sets.number(cluster_of_);
  evaluation_->counts["frontier"] = frontier_voxels_;
}

/// Merge voids that neighbour each other across groups. Most nodes have no such neighbour with which they fit
/// together, not even by way of others, and are done.
void Evaluator::joinAcross() {
  leader_.resize(node_start_.back());
  std::iota(leader_.begin(), leader_.end(), 0);
  Concerned nodes(*this);
  VoidGraph graph;
  nodes.take(graph);
  evaluation_->counts["merge_nodes"] = static_cast<int64_t>(graph.nodes.size());
  std::vector<int> merged_into;
  const VoidGraph merged = mergeNearestFirst(graph, rule(), merged_into);
  takeJoined(nodes.numbers(), merged, merged_into);
}

/// @param node_of per node of the graph that was merged, its number among those of all groups.
void Evaluator::takeJoined(const std::vector<int>& node_of, const VoidGraph& merged,
                           const std::vector<int>& merged_into) {
  std::vector<int> leader(merged.nodes.size(), INT_MAX), members(merged.nodes.size(), 0);
  for (std::size_t i = 0; i < node_of.size(); ++i) {
    leader[merged_into[i]] = std::min(leader[merged_into[i]], node_of[i]);
    ++members[merged_into[i]];
  }
  for (std::size_t i = 0; i < node_of.size(); ++i) leader_[node_of[i]] = leader[merged_into[i]];
  std::vector<Joined> joined;
  auto old = joined_.begin();
  for (std::size_t i = 0; i < merged.nodes.size(); ++i) {
    if (members[i] == 1) continue;
    const VoidNode& node = merged.nodes[i];
    while (old != joined_.end() && old->what.id < node.id) ++old;
    const bool same = old != joined_.end() && old->what == node;
    joined.push_back({leader[i], node, same ? old->fit : fitEllipsoid(node.moments, model())});
  }
  joined_ = std::move(joined);
}

/// Number the void clusters, largest count first, and list their ellipsoids.
void Evaluator::rankEllipsoids() {
  evaluation_->counts["void"] = void_voxels_;
  ellipsoid_of_.resize(node_start_.back());
  if (!config_.tiled) {
    for (std::size_t t = 0; t < tiles_.size(); ++t)
      for (int label = 0; label < labels_[t]; ++label)
        ellipsoid_of_[nodeOf(static_cast<int>(t), label)] = whole_[t][label];
    return;
  }
  std::vector<const Ellipsoid*> fits(node_start_.back(), nullptr);
  for (std::size_t g = 0; g < groups_.size(); ++g)
    for (int i = node_start_[g]; i < node_start_[g + 1]; ++i)
      if (leader_[i] == i) fits[i] = &groups_[g].fits[i - node_start_[g]];
  for (const Joined& joined : joined_) fits[joined.node] = &joined.fit;
  const std::vector<int> order = largestFirst(fits);
  std::vector<Ellipsoid>& out = evaluation_->ellipsoids;
  out.reserve(order.size());
  for (const int i : order) {
    ellipsoid_of_[i] = static_cast<int>(out.size());
    out.push_back(*fits[i]);
  }
  for (std::size_t i = 0; i < leader_.size(); ++i) ellipsoid_of_[i] = ellipsoid_of_[leader_[i]];
}

/// The procedure of the thesis over all void voxels at once.
void Evaluator::clusterWhole() {
  std::vector<Voxel> voxels;
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    if (tiles_[t]) {
      const std::vector<Voxel> some = maskVoxels(tiles_[t]->voids.mask, tileCorner(static_cast<int>(t)));
      voxels.insert(voxels.end(), some.begin(), some.end());
      void_touched_[t] = (1u << 27) - 1;
    }
  std::sort(voxels.begin(), voxels.end(),
            [](const Voxel& a, const Voxel& b) { return voxelId(a) < voxelId(b); });
  std::vector<int> labels;
  const VoidGraph graph = clusterVoids(voxels, rule(), labels);
  std::vector<Ellipsoid> fits;
  for (const VoidNode& node : graph.nodes) fits.push_back(fitEllipsoid(node.moments, model()));
  std::vector<const Ellipsoid*> all;
  for (const Ellipsoid& fit : fits) all.push_back(&fit);
  std::vector<int> rank(fits.size());
  for (const int i : largestFirst(all)) {
    rank[i] = static_cast<int>(evaluation_->ellipsoids.size());
    evaluation_->ellipsoids.push_back(fits[i]);
  }
  // A tile's labels: its ellipsoids in the order in which its voxels, ascending, come to them.
  std::vector<std::vector<int>> own(tiles_.size()), ellipsoids(tiles_.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const int t = frame_.tileOf(voxels[i]), ellipsoid = rank[labels[i]];
    auto found = std::find(ellipsoids[t].begin(), ellipsoids[t].end(), ellipsoid);
    if (found == ellipsoids[t].end()) found = ellipsoids[t].insert(found, ellipsoid);
    own[t].push_back(static_cast<int>(found - ellipsoids[t].begin()));
  }
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    labels_[t] = static_cast<int>(ellipsoids[t].size());
    if (!tiles_[t]) continue;
    tiles_[t]->voids.runs = runsOf(tiles_[t]->voids.mask, own[t]);
    tiles_[t]->voids.labels = labels_[t];
  }
  whole_ = std::move(ellipsoids);
}

void Evaluator::pairFrontierVoids() {
  // Frontier clusters of each ellipsoid, counted first, so that all lie in one list.
  std::vector<int> end(evaluation_->ellipsoids.size() + 1, 0);
  const auto forEachPair = [&](const auto& visit) {
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const int *clusters = cluster_of_.data() + part_start_[g],
                *ellipsoids = ellipsoid_of_.data() + node_start_[g];
      for (const auto& [part, node] : groups_[g].pairs) visit(ellipsoids[node], clusters[part]);
      for (const Across& link : groups_[g].pairs_across)
        visit(ellipsoid_of_[nodeOf(link.tile, link.label)], clusters[link.own]);
    }
  };
  forEachPair([&](int ellipsoid, int) { ++end[ellipsoid + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<int> clusters(end.back());
  forEachPair([&](int ellipsoid, int cluster) { clusters[end[ellipsoid]++] = cluster; });
  std::vector<int>& out = evaluation_->neighbour_clusters;
  auto begin = clusters.begin();
  for (std::size_t i = 0; i < evaluation_->ellipsoids.size(); ++i) {
    const auto finish = clusters.begin() + end[i];
    if (begin == finish) continue;
    std::sort(begin, finish);
    const int first = static_cast<int>(out.size());
    out.insert(out.end(), begin, std::unique(begin, finish));
    evaluation_->frontier_voids.push_back({static_cast<int>(i), first, static_cast<int>(out.size())});
    begin = finish;
  }
}

void Evaluator::frontier(std::vector<Voxel>& voxels, std::vector<int>& clusters) const {
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    if (tiles_[t])
      forEachLabel(tiles_[t]->frontier, tileCorner(static_cast<int>(t)), [&](const Voxel& v, int label) {
        voxels.push_back(v);
        clusters.push_back(cluster_of_[partOf(static_cast<int>(t), label)]);
      });
}

void Evaluator::voids(std::vector<Voxel>& voxels, std::vector<int>& ellipsoids) const {
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    if (tiles_[t])
      forEachLabel(tiles_[t]->voids, tileCorner(static_cast<int>(t)), [&](const Voxel& v, int label) {
        voxels.push_back(v);
        ellipsoids.push_back(ellipsoid_of_[nodeOf(static_cast<int>(t), label)]);
      });
}

std::vector<Ellipsoid> Evaluator::initialEllipsoids() const {
  std::vector<Ellipsoid> out;
  std::vector<int> labels;
  std::vector<Voxel> voxels, whole;
  const auto seed = [&](const std::vector<Voxel>& some) {
    for (const VoidNode& node : seedEllipsoids(some, rule(), labels).nodes)
      out.push_back(fitEllipsoid(node.moments, model()));
  };
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (!tiles_[t]) continue;
    voxels = maskVoxels(tiles_[t]->voids.mask, tileCorner(static_cast<int>(t)));
    if (config_.tiled)
      seed(voxels);
    else
      whole.insert(whole.end(), voxels.begin(), voxels.end());
  }
  std::sort(whole.begin(), whole.end(),
            [](const Voxel& a, const Voxel& b) { return voxelId(a) < voxelId(b); });
  seed(whole);
  return out;
}

}  // namespace fv
