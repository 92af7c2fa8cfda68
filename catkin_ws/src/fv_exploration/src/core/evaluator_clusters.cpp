// The part of Evaluator that makes clusters of tiles: frontiers by union-find, voids by merging, and their
// neighbourhoods.
#include <algorithm>
#include <numeric>

#include "fv_exploration/evaluator.h"
#include "fv_exploration/parallel.h"
#include "marked_tiles.h"

namespace fv {

void Evaluator::numberFrontiers() {
  std::vector<int> start(tiles_.size() + 1, 0);
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    start[t + 1] = start[t] + (tiles_[t] ? tiles_[t]->components : 0);
  std::vector<int> parent(start.back());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  int64_t voxels = 0;
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    if (tiles_[t])
      for (const TileLink& link : tiles_[t]->frontier_links) {
        const int a = find(start[t] + link.own);
        const int b = find(start[neighbourIndex(static_cast<int>(t), link.direction)] + link.other);
        parent[std::max(a, b)] = std::min(a, b);
      }
  std::vector<int> number(parent.size(), -1);
  int clusters = 0;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (!tiles_[t]) continue;
    voxels += maskCount(tiles_[t]->frontier);
    tiles_[t]->cluster.resize(tiles_[t]->components);
    for (int c = 0; c < tiles_[t]->components; ++c) {
      const int root = find(start[t] + c);
      if (number[root] < 0) number[root] = clusters++;
      tiles_[t]->cluster[c] = number[root];
    }
  }
  evaluation_.clusters = clusters;
  evaluation_.counts["frontier"] = voxels;
}

void Evaluator::mergeGroup(Group& group, const std::vector<int>& members) {
  group.members = members;
  VoidGraph all;
  std::map<int, int> start;
  for (const int t : members) {
    const int first = start[t] = static_cast<int>(all.nodes.size());
    all.nodes.insert(all.nodes.end(), tiles_[t]->graph.nodes.begin(), tiles_[t]->graph.nodes.end());
    for (const auto& [a, b] : tiles_[t]->graph.edges) all.edges.emplace_back(first + a, first + b);
  }
  for (const int t : members)
    for (const TileLink& link : tiles_[t]->void_links) {
      const auto other = start.find(neighbourIndex(t, link.direction));
      if (other != start.end()) all.edges.emplace_back(start[t] + link.own, other->second + link.other);
    }
  group.graph = mergeNearestFirst(std::move(all), rule(), group.merged_into);
}

void Evaluator::clusterTiled() {
  // Groups of 4x4x4 tiles, anew where a tile's voids or its links have changed.
  const auto groupOf = [&](int t) {
    const Voxel g = frame_.tile(t) / 4;
    return (g.z() * group_counts_.y() + g.y()) * group_counts_.x() + g.x();
  };
  std::vector<uint8_t> stale(groups_.size(), 0);
  for (const int t : marked(around(void_changed_, true))) stale[groupOf(t)] = 1;
  std::vector<std::vector<int>> members(groups_.size());
  int64_t voids = 0;
  for (int t = 0; t < static_cast<int>(tiles_.size()); ++t)
    if (tiles_[t] && !tiles_[t]->graph.nodes.empty()) {
      voids += maskCount(tiles_[t]->voids);
      members[groupOf(t)].push_back(t);
    }
  const std::vector<int> list = marked(stale);
  parallelChunks(static_cast<int>(list.size()), threadCount(config_.threads), 1,
                 [&](int begin, int end, int) {
                   for (int i = begin; i < end; ++i) mergeGroup(groups_[list[i]], members[list[i]]);
                 });
  // All groups together.
  VoidGraph all;
  std::vector<int> first_node(groups_.size());
  std::vector<std::vector<int>> node(tiles_.size());  // per tile node its node in `all`
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Group& group = groups_[g];
    first_node[g] = static_cast<int>(all.nodes.size());
    if (members[g].empty()) continue;
    all.nodes.insert(all.nodes.end(), group.graph.nodes.begin(), group.graph.nodes.end());
    for (const auto& [a, b] : group.graph.edges) all.edges.emplace_back(first_node[g] + a, first_node[g] + b);
    std::size_t at = 0;
    for (const int t : group.members)
      for (std::size_t i = 0; i < tiles_[t]->graph.nodes.size(); ++i)
        node[t].push_back(first_node[g] + group.merged_into[at++]);
  }
  std::vector<std::pair<int, int>> across;
  for (int t = 0; t < static_cast<int>(tiles_.size()); ++t)
    if (!node[t].empty())
      for (const TileLink& link : tiles_[t]->void_links) {
        const int n = neighbourIndex(t, link.direction);
        if (groupOf(n) != groupOf(t))
          across.emplace_back(std::minmax(node[t][link.own], node[n][link.other]));
      }
  std::sort(across.begin(), across.end());
  across.erase(std::unique(across.begin(), across.end()), across.end());
  all.edges.insert(all.edges.end(), across.begin(), across.end());
  evaluation_.counts["merge_nodes"] = static_cast<int64_t>(all.nodes.size());
  std::vector<int> merged_into, rank;
  takeEllipsoids(mergeNearestFirst(std::move(all), rule(), merged_into), rank);
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (!tiles_[t]) continue;
    tiles_[t]->ellipsoid.clear();
    for (const int i : node[t]) tiles_[t]->ellipsoid.push_back(rank[merged_into[i]]);
  }
  evaluation_.counts["void"] = voids;
}

/// The procedure of the thesis over all void voxels at once.
void Evaluator::clusterWhole() {
  std::vector<Voxel> voxels;
  for (std::size_t t = 0; t < tiles_.size(); ++t)
    if (tiles_[t]) {
      const std::vector<Voxel> some = maskVoxels(tiles_[t]->voids, tileCorner(static_cast<int>(t)));
      voxels.insert(voxels.end(), some.begin(), some.end());
      tiles_[t]->void_labels.clear();
      tiles_[t]->ellipsoid.clear();
      void_changed_[t] = 1;
    }
  std::sort(voxels.begin(), voxels.end(),
            [](const Voxel& a, const Voxel& b) { return voxelId(a) < voxelId(b); });
  std::vector<int> labels, rank;
  takeEllipsoids(clusterVoids(voxels, rule(), labels), rank);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const int t = frame_.tileOf(voxels[i]);
    Tile& tile = *tiles_[t];
    if (tile.void_labels.empty()) tile.void_labels.assign(kTileVoxels, 0);
    const int ellipsoid = rank[labels[i]];
    auto found = std::find(tile.ellipsoid.begin(), tile.ellipsoid.end(), ellipsoid);
    if (found == tile.ellipsoid.end()) found = tile.ellipsoid.insert(found, ellipsoid);
    const Voxel d = voxels[i] - tileCorner(t);
    tile.void_labels[d.x() + kTile * (d.y() + kTile * d.z())] =
        static_cast<uint16_t>(found - tile.ellipsoid.begin() + 1);
  }
  evaluation_.counts["void"] = static_cast<int64_t>(voxels.size());
}

/// Ellipsoids of the nodes, largest count first; `rank`: per node its ellipsoid.
void Evaluator::takeEllipsoids(const VoidGraph& graph, std::vector<int>& rank) {
  std::vector<int> order(graph.nodes.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const VoidNode &p = graph.nodes[a], &q = graph.nodes[b];
    return p.moments.n != q.moments.n ? p.moments.n > q.moments.n : p.id < q.id;
  });
  rank.resize(order.size());
  evaluation_.ellipsoids.clear();
  for (const int i : order) {
    rank[i] = static_cast<int>(evaluation_.ellipsoids.size());
    evaluation_.ellipsoids.push_back(fitEllipsoid(graph.nodes[i].moments, model()));
  }
}

void Evaluator::pairFrontierVoids() {
  std::vector<std::pair<int, int>> pairs;
  for (int t = 0; t < static_cast<int>(tiles_.size()); ++t)
    if (tiles_[t])
      for (const TileLink& link : tiles_[t]->frontier_voids)
        pairs.emplace_back(neighbour(t, link.direction)->ellipsoid[link.other], tiles_[t]->cluster[link.own]);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (const auto& [ellipsoid, cluster] : pairs) {
    auto& out = evaluation_.frontier_voids;
    if (out.empty() || out.back().ellipsoid != ellipsoid) out.push_back({ellipsoid, {}});
    out.back().clusters.push_back(cluster);
  }
}

void Evaluator::frontier(std::vector<Voxel>& voxels, std::vector<int>& clusters) const {
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (!tiles_[t]) continue;
    const Voxel corner = tileCorner(static_cast<int>(t));
    for (const Voxel& v : maskVoxels(tiles_[t]->frontier, corner)) {
      const Voxel d = v - corner;
      voxels.push_back(v);
      clusters.push_back(
          tiles_[t]->cluster[tiles_[t]->frontier_labels[d.x() + kTile * (d.y() + kTile * d.z())] - 1]);
    }
  }
}

void Evaluator::voids(std::vector<Voxel>& voxels, std::vector<int>& ellipsoids) const {
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (!tiles_[t]) continue;
    const Voxel corner = tileCorner(static_cast<int>(t));
    for (const Voxel& v : maskVoxels(tiles_[t]->voids, corner)) {
      const Voxel d = v - corner;
      voxels.push_back(v);
      ellipsoids.push_back(
          tiles_[t]->ellipsoid[tiles_[t]->void_labels[d.x() + kTile * (d.y() + kTile * d.z())] - 1]);
    }
  }
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
    voxels = maskVoxels(tiles_[t]->voids, tileCorner(static_cast<int>(t)));
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
