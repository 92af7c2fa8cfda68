// The part of Evaluator that makes clusters of tiles: frontiers by union-find, voids by merging, and their
// neighbourhoods.
#include <algorithm>
#include <numeric>

#include "fv_exploration/evaluator.h"
#include "fv_exploration/parallel.h"
#include "marked_tiles.h"

namespace fv {

namespace {

/// Sums of all counts before each one, and of all at the end.
std::vector<int> startsOf(const std::vector<int>& counts) {
  std::vector<int> start(counts.size() + 1, 0);
  std::partial_sum(counts.begin(), counts.end(), start.begin() + 1);
  return start;
}

}  // namespace

void Evaluator::numberFrontiers() {
  component_start_ = startsOf(components_);
  std::vector<int> parent(component_start_.back());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const int count = static_cast<int>(tiles_.size());
  for (int t = 0; t < count; ++t)
    if (components_[t])
      for (const TileLink& link : tiles_[t]->frontier_links) {
        const int a = find(component_start_[t] + link.own);
        const int b = find(component_start_[t + step_to_[link.direction]] + link.other);
        parent[std::max(a, b)] = std::min(a, b);
      }
  cluster_of_.resize(parent.size());
  int clusters = 0;
  for (int i = 0; i < static_cast<int>(parent.size()); ++i) {  // the root of a cluster is its first component
    const int root = find(i);
    cluster_of_[i] = root == i ? clusters++ : cluster_of_[root];
  }
  evaluation_->clusters = clusters;
  evaluation_->counts["frontier"] = frontier_voxels_;
}

void Evaluator::mergeGroup(int g) {
  VoidGraph all;
  for (const int t : group_tiles_[g]) {
    const int first = first_in_group_[t] = static_cast<int>(all.nodes.size());
    if (nodes_[t] == 0) continue;
    const VoidGraph& graph = tiles_[t]->graph;
    all.nodes.insert(all.nodes.end(), graph.nodes.begin(), graph.nodes.end());
    for (const auto& [a, b] : graph.edges) all.edges.emplace_back(first + a, first + b);
  }
  all.settled = all.edges.size();
  for (const int t : group_tiles_[g]) {
    if (nodes_[t] == 0) continue;
    for (const TileLink& link : tiles_[t]->void_links) {
      const int n = t + step_to_[link.direction];
      if (group_of_[n] == g)
        all.edges.emplace_back(first_in_group_[t] + link.own, first_in_group_[n] + link.other);
    }
  }
  groups_[g].graph = mergeNearestFirst(all, rule(), groups_[g].merged_into);
}

void Evaluator::clusterTiled() {
  // Groups of 4x4x4 tiles, anew where the voids of a tile have changed.
  std::vector<uint8_t> stale(groups_.size(), 0);
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    if (void_touched_[t]) stale[group_of_[t]] = 1;
  const std::vector<int> list = marked(stale);
  parallelChunks(static_cast<int>(list.size()), threadCount(config_.threads), 1,
                 [&](int begin, int end, int) {
                   for (int i = begin; i < end; ++i) mergeGroup(list[i]);
                 });
  // All groups together.
  node_start_ = startsOf(nodes_);
  ellipsoid_of_.resize(node_start_.back());
  std::vector<int> node_of(node_start_.back()), merged_into;
  mergeGroups(node_of, merged_into);
  for (std::size_t i = 0; i < node_of.size(); ++i) ellipsoid_of_[i] = merged_into[node_of[i]];
  evaluation_->counts["void"] = void_voxels_;
}

/// Merge the nodes of all groups. @param[out] node_of per void label its node, and per node its ellipsoid.
void Evaluator::mergeGroups(std::vector<int>& node_of, std::vector<int>& ellipsoid_of_node) {
  VoidGraph all;
  std::vector<int> first(groups_.size());
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    first[g] = static_cast<int>(all.nodes.size());
    const VoidGraph& graph = groups_[g].graph;
    all.nodes.insert(all.nodes.end(), graph.nodes.begin(), graph.nodes.end());
    for (const auto& [a, b] : graph.edges) all.edges.emplace_back(first[g] + a, first[g] + b);
  }
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const int* merged = groups_[group_of_[t]].merged_into.data() + first_in_group_[t];
    for (int i = 0; i < nodes_[t]; ++i) node_of[node_start_[t] + i] = first[group_of_[t]] + merged[i];
  }
  all.settled = all.edges.size();
  const std::vector<std::pair<int, int>> across = edgesAcross(node_of);
  all.edges.insert(all.edges.end(), across.begin(), across.end());
  evaluation_->counts["merge_nodes"] = static_cast<int64_t>(all.nodes.size());
  std::vector<int> rank;
  takeEllipsoids(mergeNearestFirst(all, rule(), ellipsoid_of_node), rank);
  for (int& node : ellipsoid_of_node) node = rank[node];
}

/// Nodes of different groups that neighbour each other, each pair once.
std::vector<std::pair<int, int>> Evaluator::edgesAcross(const std::vector<int>& node_of) const {
  std::vector<std::pair<int, int>> across;
  for (int t = 0; t < static_cast<int>(tiles_.size()); ++t) {
    if (nodes_[t] == 0) continue;
    for (const TileLink& link : tiles_[t]->void_links) {
      const int n = t + step_to_[link.direction];
      if (group_of_[n] != group_of_[t])
        across.emplace_back(
            std::minmax(node_of[node_start_[t] + link.own], node_of[node_start_[n] + link.other]));
    }
  }
  std::sort(across.begin(), across.end());
  across.erase(std::unique(across.begin(), across.end()), across.end());
  return across;
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
  std::vector<int> labels, rank;
  takeEllipsoids(clusterVoids(voxels, rule(), labels), rank);
  // A tile's labels: its ellipsoids in the order in which its voxels, ascending, come to them.
  std::vector<std::vector<int>> own(tiles_.size()), ellipsoids(tiles_.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const int t = frame_.tileOf(voxels[i]), ellipsoid = rank[labels[i]];
    auto found = std::find(ellipsoids[t].begin(), ellipsoids[t].end(), ellipsoid);
    if (found == ellipsoids[t].end()) found = ellipsoids[t].insert(found, ellipsoid);
    own[t].push_back(static_cast<int>(found - ellipsoids[t].begin()));
  }
  ellipsoid_of_.clear();
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    nodes_[t] = static_cast<int>(ellipsoids[t].size());
    ellipsoid_of_.insert(ellipsoid_of_.end(), ellipsoids[t].begin(), ellipsoids[t].end());
    if (tiles_[t]) tiles_[t]->voids.runs = runsOf(tiles_[t]->voids.mask, own[t]);
  }
  node_start_ = startsOf(nodes_);
  evaluation_->counts["void"] = void_voxels_;
}

/// Ellipsoids of the nodes, which ascend by id, largest count first; `rank`: per node its ellipsoid.
void Evaluator::takeEllipsoids(const VoidGraph& graph, std::vector<int>& rank) {
  std::vector<Ellipsoid> fits;
  std::vector<std::pair<int64_t, int>> order;
  std::size_t old = 0;
  for (const VoidNode& node : graph.nodes) {
    while (old < fitted_nodes_.size() && fitted_nodes_[old].id < node.id) ++old;
    const bool same = old < fitted_nodes_.size() && fitted_nodes_[old].id == node.id &&
                      fitted_nodes_[old].moments == node.moments;
    order.emplace_back(-node.moments.n, static_cast<int>(fits.size()));
    fits.push_back(same ? fits_[old] : fitEllipsoid(node.moments, model()));
  }
  std::sort(order.begin(), order.end());
  rank.resize(order.size());
  for (const auto& [count, i] : order) {
    rank[i] = static_cast<int>(evaluation_->ellipsoids.size());
    evaluation_->ellipsoids.push_back(fits[i]);
  }
  fitted_nodes_ = graph.nodes;
  fits_ = std::move(fits);
}

void Evaluator::pairFrontierVoids() {
  std::vector<std::vector<int>> clusters(evaluation_->ellipsoids.size());
  for (int t = 0; t < static_cast<int>(tiles_.size()); ++t)
    if (components_[t])
      for (const TileLink& link : tiles_[t]->frontier_voids) {
        const int label = node_start_[t + step_to_[link.direction]] + link.other;
        clusters[ellipsoid_of_[label]].push_back(cluster_of_[component_start_[t] + link.own]);
      }
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    if (clusters[i].empty()) continue;
    std::sort(clusters[i].begin(), clusters[i].end());
    clusters[i].erase(std::unique(clusters[i].begin(), clusters[i].end()), clusters[i].end());
    evaluation_->frontier_voids.push_back({static_cast<int>(i), std::move(clusters[i])});
  }
}

void Evaluator::frontier(std::vector<Voxel>& voxels, std::vector<int>& clusters) const {
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    if (tiles_[t])
      forEachLabel(tiles_[t]->frontier, tileCorner(static_cast<int>(t)), [&](const Voxel& v, int label) {
        voxels.push_back(v);
        clusters.push_back(cluster_of_[component_start_[t] + label]);
      });
}

void Evaluator::voids(std::vector<Voxel>& voxels, std::vector<int>& ellipsoids) const {
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    if (tiles_[t])
      forEachLabel(tiles_[t]->voids, tileCorner(static_cast<int>(t)), [&](const Voxel& v, int label) {
        voxels.push_back(v);
        ellipsoids.push_back(ellipsoid_of_[node_start_[t] + label]);
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
