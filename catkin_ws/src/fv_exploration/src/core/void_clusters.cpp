#include "fv_exploration/void_clusters.h"

#include <algorithm>
#include <numeric>

#include "pair_queue.h"

namespace fv {

namespace {

/// Nodes in the order of their ids that merge into the lower one; the pairs that may still merge are in a
/// queue.
class Merging {
 public:
  Merging(VoidGraph graph, const ClusterRule& rule)
      : rule_(rule), slot_(graph.nodes.size()), nodes_(std::move(graph.nodes)), parent_(nodes_.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    std::vector<int> order(parent_);
    const auto less = [&](int a, int b) { return nodes_[a].id < nodes_[b].id; };
    if (!std::is_sorted(order.begin(), order.end(), less)) {
      std::sort(order.begin(), order.end(), less);
      std::vector<VoidNode> sorted;
      for (const int i : order) sorted.push_back(nodes_[i]);
      nodes_.swap(sorted);
    }
    for (std::size_t i = 0; i < order.size(); ++i) slot_[order[i]] = static_cast<int>(i);
    for (const VoidNode& node : nodes_) count_.push_back(node.moments.n);
    seen_.assign(nodes_.size(), 0);
    link(graph.edges, graph.settled);
  }

  void run() {
    const auto current = [&](const Pair& p) { return count_[p.low] + count_[p.high] == p.count; };
    Pair pair;
    while (queue_.pop(current, pair))
      if (current(pair)) merge(pair.low, pair.high);
  }

  VoidGraph result(std::vector<int>& merged_into) {
    std::vector<int> rank(nodes_.size(), -1);
    VoidGraph out;
    for (int i = 0; i < static_cast<int>(nodes_.size()); ++i)
      if (parent_[i] == i) {
        rank[i] = static_cast<int>(out.nodes.size());
        out.nodes.push_back(nodes_[i]);
      }
    for (int i = 0; i < static_cast<int>(nodes_.size()); ++i) {
      if (rank[i] < 0) continue;
      for (const int j : liveNeighbours(i))
        if (i < j) out.edges.emplace_back(rank[i], rank[j]);
    }
    out.settled = out.edges.size();
    merged_into.resize(slot_.size());
    for (std::size_t i = 0; i < slot_.size(); ++i) merged_into[i] = rank[find(slot_[i])];
    return out;
  }

 private:
  void link(const std::vector<std::pair<int, int>>& edges, std::size_t settled) {
    std::vector<int> degree(nodes_.size(), 0);
    for (const auto& [a, b] : edges) {
      ++degree[slot_[a]];
      ++degree[slot_[b]];
    }
    neighbours_.resize(nodes_.size());
    for (std::size_t i = 0; i < degree.size(); ++i) neighbours_[i].reserve(degree[i]);
    for (const auto& [a, b] : edges) {
      neighbours_[slot_[a]].push_back(slot_[b]);
      neighbours_[slot_[b]].push_back(slot_[a]);
    }
    for (std::size_t i = settled; i < edges.size(); ++i) push(slot_[edges[i].first], slot_[edges[i].second]);
  }

  int find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  /// The nodes that the neighbours have become, each once, without itself.
  const std::vector<int>& liveNeighbours(int i) {
    seen_[i] = ++stamp_;
    std::vector<int>& list = neighbours_[i];
    std::size_t kept = 0;
    for (const int old : list) {
      const int j = find(old);
      if (seen_[j] == stamp_) continue;
      seen_[j] = stamp_;
      list[kept++] = j;
    }
    list.resize(kept);
    return list;
  }

  void push(int a, int b) {
    const Moments both = nodes_[a].moments + nodes_[b].moments;
    if (!(ellipsoidFit(both, rule_.model) >= rule_.min_fit)) return;  // never, unless one of them changes
    // From the lower id to the higher, so that rounding does not depend on the order of building.
    const auto [low, high] = std::minmax(a, b);
    queue_.push({Moments::squaredDistance(nodes_[low].moments, nodes_[high].moments), low, high, both.n});
  }

  /// Sums lie scattered over memory: ask for those of all neighbours at once.
  static void fetch(const VoidNode& node) {
    __builtin_prefetch(&node);
    __builtin_prefetch(reinterpret_cast<const char*>(&node + 1) - 1);
  }

  void merge(int low, int high) {
    nodes_[low].moments += nodes_[high].moments;
    parent_[high] = low;
    count_[low] = nodes_[low].moments.n;
    count_[high] = kGone;
    std::vector<int>&kept = neighbours_[low], &other = neighbours_[high];
    if (kept.size() < other.size()) kept.swap(other);
    kept.insert(kept.end(), other.begin(), other.end());
    std::vector<int>().swap(other);
    const std::vector<int>& around = liveNeighbours(low);  // they know it by the names of its parts
    for (const int j : around) fetch(nodes_[j]);
    for (const int j : around) push(low, j);
  }

  const ClusterRule& rule_;
  std::vector<int> slot_;  // per node of the graph its place in nodes_
  std::vector<VoidNode> nodes_;
  static constexpr int64_t kGone = -(int64_t{1} << 62);
  std::vector<int64_t> count_;  // voxels of a node, kGone when it is part of another
  std::vector<int> parent_;
  std::vector<std::vector<int>> neighbours_;
  PairQueue queue_;
  std::vector<int> seen_;
  int stamp_ = 0;
};

/// A well mixed number of a voxel (splitmix64 by Steele, Lea and Flood 2014).
uint64_t mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Where voxels lie in a box with a margin of one, and which voxel lies where.
struct LabelBox {
  std::vector<int> at;        // per voxel its cell
  std::vector<int32_t> cell;  // per cell the label, kNone or kOpen
  int neighbour[26];          // cell offsets, the 13 that lead to higher voxelIds last
  static constexpr int32_t kNone = -2, kOpen = -1;

  explicit LabelBox(const std::vector<Voxel>& voxels) {
    Voxel min = voxels[0], max = voxels[0];
    for (const Voxel& v : voxels) {
      min = min.cwiseMin(v);
      max = max.cwiseMax(v);
    }
    const Voxel dims = max - min + Voxel::Constant(3);
    cell.assign(static_cast<std::size_t>(dims.x()) * dims.y() * dims.z(), kNone);
    at.reserve(voxels.size());
    for (const Voxel& v : voxels) {
      const Voxel d = v - min + Voxel::Ones();
      at.push_back((d.z() * dims.y() + d.y()) * dims.x() + d.x());
      cell[at.back()] = kOpen;
    }
    int i = 0;
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          if (x || y || z) neighbour[i++] = (z * dims.y() + y) * dims.x() + x;
  }
};

/// Pairs of labels with neighbouring voxels, each once.
std::vector<std::pair<int, int>> labelEdges(const LabelBox& box, const std::vector<int>& labels, int count) {
  std::vector<int> start(count + 1, 0), order(labels.size());
  for (const int label : labels) ++start[label + 1];
  for (int i = 0; i < count; ++i) start[i + 1] += start[i];
  std::vector<int> fill(start.begin(), start.end() - 1);
  for (int i = 0; i < static_cast<int>(labels.size()); ++i) order[fill[labels[i]]++] = i;
  std::vector<int> seen(count, -1);
  std::vector<std::pair<int, int>> edges;
  for (int label = 0; label < count; ++label)
    for (int k = start[label]; k < start[label + 1]; ++k)
      for (const int offset : box.neighbour) {
        const int other = box.cell[box.at[order[k]] + offset];
        if (other <= label || seen[other] == label) continue;
        seen[other] = label;
        edges.emplace_back(label, other);
      }
  return edges;
}

}  // namespace

VoidGraph mergeNearestFirst(VoidGraph graph, const ClusterRule& rule, std::vector<int>& merged_into) {
  Merging merging(std::move(graph), rule);
  merging.run();
  return merging.result(merged_into);
}

VoidGraph seedEllipsoids(const std::vector<Voxel>& voxels, const ClusterRule& rule,
                         std::vector<int>& labels) {
  VoidGraph graph;
  labels.assign(voxels.size(), -1);
  if (voxels.empty()) return graph;
  LabelBox box(voxels);
  int seeds = 0;
  const auto attach = [&](int i) {
    const int label = seeds++;
    box.cell[box.at[i]] = label;
    for (const int offset : box.neighbour) {
      int32_t& cell = box.cell[box.at[i] + offset];
      if (cell == LabelBox::kOpen) cell = label;
    }
  };
  const auto limit = static_cast<uint64_t>(rule.seed_share * 18446744073709549568.0);  // of 2^64
  const int count = static_cast<int>(voxels.size());
  for (const bool random : {true, false})
    for (int i = 0; i < count; ++i)
      if (box.cell[box.at[i]] == LabelBox::kOpen &&
          (!random || mix(voxelId(voxels[i]) ^ mix(rule.seed)) < limit))
        attach(i);
  // Numbered anew in the order of their first voxels, so that neighbours lie near each other in memory too.
  std::vector<int> number(seeds, -1);
  graph.nodes.reserve(seeds);
  for (int i = 0; i < count; ++i) {
    int32_t& cell = box.cell[box.at[i]];
    if (number[cell] < 0) {
      number[cell] = static_cast<int>(graph.nodes.size());
      graph.nodes.push_back({{}, voxelId(voxels[i])});
    }
    labels[i] = cell = number[cell];
    graph.nodes[labels[i]].moments.add(voxels[i]);
  }
  graph.edges = labelEdges(box, labels, seeds);
  return graph;
}

VoidGraph clusterVoids(const std::vector<Voxel>& voxels, const ClusterRule& rule, std::vector<int>& labels) {
  std::vector<int> merged_into;
  VoidGraph merged = mergeNearestFirst(seedEllipsoids(voxels, rule, labels), rule, merged_into);
  for (int& label : labels) label = merged_into[label];
  return merged;
}

}  // namespace fv
