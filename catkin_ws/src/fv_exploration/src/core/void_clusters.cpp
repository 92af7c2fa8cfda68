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
  Merging(const VoidGraph& graph, const ClusterRule& rule)
      : rule_(rule), slot_(graph.nodes.size()), queue_(graph.edges.size()) {
    std::vector<int> order(graph.nodes.size());
    std::iota(order.begin(), order.end(), 0);
    const auto less = [&](int a, int b) { return graph.nodes[a].id < graph.nodes[b].id; };
    if (!std::is_sorted(order.begin(), order.end(), less)) std::sort(order.begin(), order.end(), less);
    ids_.reserve(order.size());
    nodes_.reserve(order.size());
    sums_.reserve(order.size());
    for (const int i : order) {
      slot_[i] = static_cast<int>(sums_.size());
      ids_.push_back(graph.nodes[i].id);
      nodes_.push_back({slot_[i], 0, graph.nodes[i].moments.n});
      sums_.push_back(graph.nodes[i].moments);
    }
    link(graph);
  }

  void run() {
    const auto current = [&](const Pair& p) { return nodes_[p.low].count + nodes_[p.high].count == p.count; };
    Pair pair;
    while (queue_.pop(current, pair)) {
      fetchAhead();
      if (current(pair)) merge(pair.low, pair.high);
    }
  }

  VoidGraph result(std::vector<int>& merged_into) {
    const int count = static_cast<int>(sums_.size());
    std::vector<int> rank(count, -1);
    VoidGraph out;
    for (int i = 0; i < count; ++i)
      if (nodes_[i].parent == i) {
        rank[i] = static_cast<int>(out.nodes.size());
        out.nodes.push_back({sums_[i], ids_[i]});
      }
    for (int i = 0; i < count; ++i)
      if (rank[i] >= 0)
        for (const int j : liveNeighbours(i, i))
          if (i < j) out.edges.emplace_back(rank[i], rank[j]);
    out.settled = out.edges.size();
    merged_into.resize(slot_.size());
    for (std::size_t i = 0; i < slot_.size(); ++i) merged_into[i] = rank[find(slot_[i])];
    return out;
  }

 private:
  static constexpr int64_t kGone = -(int64_t{1} << 62);
  struct Node {
    int parent;     // itself, or a node that it has become a part of
    int seen;       // number of the last look around that has met it
    int64_t count;  // voxels, kGone when it is part of another
  };
  struct List {
    const int* begin = nullptr;
    int size = 0;
  };

  void link(const VoidGraph& graph) {
    std::vector<int> end(sums_.size() + 1, 0);  // of each node's list, while it is filled
    for (const auto& [a, b] : graph.edges) {
      ++end[slot_[a] + 1];
      ++end[slot_[b] + 1];
    }
    std::partial_sum(end.begin(), end.end(), end.begin());
    first_lists_.resize(end.back());
    neighbours_.resize(sums_.size());
    for (std::size_t i = 0; i < sums_.size(); ++i)
      neighbours_[i] = {first_lists_.data() + end[i], end[i + 1] - end[i]};
    for (const auto& [a, b] : graph.edges) {
      first_lists_[end[slot_[a]]++] = slot_[b];
      first_lists_[end[slot_[b]]++] = slot_[a];
    }
    joined_.resize(sums_.size());
    for (std::size_t i = graph.settled; i < graph.edges.size(); ++i)
      push(slot_[graph.edges[i].first], slot_[graph.edges[i].second]);
  }

  int find(int i) {
    while (nodes_[i].parent != i) i = nodes_[i].parent = nodes_[nodes_[i].parent].parent;
    return i;
  }

  /// The nodes that the neighbours of two nodes have become, each once, without themselves; until the next
  /// call.
  const std::vector<int>& liveNeighbours(int a, int b) {
    nodes_[a].seen = nodes_[b].seen = ++stamp_;
    live_.clear();
    for (const int i : {a, b}) {
      const List list = neighbours_[i];
      for (int k = 0; k < list.size; ++k) __builtin_prefetch(&nodes_[list.begin[k]]);  // they lie scattered
      for (int k = 0; k < list.size; ++k) {
        const int j = find(list.begin[k]);
        if (nodes_[j].seen == stamp_) continue;
        nodes_[j].seen = stamp_;
        live_.push_back(j);
      }
      if (a == b) break;
    }
    return live_;
  }

  void push(int a, int b) {
    const Moments both = sums_[a] + sums_[b];
    if (!(ellipsoidFit(both, rule_.model) >= rule_.min_fit)) return;  // never, unless one of them changes
    // From the lower id to the higher, so that rounding does not depend on the order of building.
    const auto [low, high] = std::minmax(a, b);
    queue_.push({Moments::squaredDistance(sums_[low], sums_[high]), low, high, both.n});
  }

  /// Ask for what the next mergers will read: first where their lists are, then the lists.
  void fetchAhead() const {
    if (const Pair* later = queue_.ahead(8)) {
      __builtin_prefetch(&neighbours_[later->low]);
      __builtin_prefetch(&neighbours_[later->high]);
    }
    if (const Pair* soon = queue_.ahead(4)) {
      for (const int i : {soon->low, soon->high}) {
        __builtin_prefetch(neighbours_[i].begin);
        fetch(sums_[i]);
        __builtin_prefetch(&joined_[i]);
      }
    }
  }

  /// Sums lie scattered over memory: ask for those of all neighbours at once.
  static void fetch(const Moments& sums) {
    __builtin_prefetch(&sums);
    __builtin_prefetch(reinterpret_cast<const char*>(&sums + 1) - 1);
  }

  void merge(int low, int high) {
    sums_[low] += sums_[high];
    nodes_[low].count = sums_[low].n;
    nodes_[high].parent = low;
    nodes_[high].count = kGone;
    const std::vector<int>& around = liveNeighbours(low, high);  // they know it by the names of its parts
    for (const int j : around) fetch(sums_[j]);
    joined_[low].assign(around.begin(), around.end());
    std::vector<int>().swap(joined_[high]);
    neighbours_[low] = {joined_[low].data(), static_cast<int>(joined_[low].size())};
    for (const int j : around) push(low, j);
  }

  const ClusterRule& rule_;
  std::vector<int> slot_;  // per node of the graph its place here
  std::vector<uint64_t> ids_;
  BigVector<Moments> sums_;
  BigVector<Node> nodes_;
  BigVector<int> first_lists_;            // neighbours as the graph has them
  std::vector<std::vector<int>> joined_;  // neighbours of nodes that have merged
  std::vector<List> neighbours_;          // in one of these
  PairQueue queue_;
  std::vector<int> live_;
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
  BigVector<int> at;        // per voxel its cell
  BigVector<int32_t> cell;  // per cell the label, kNone or kOpen
  int neighbour[26];        // cell offsets, the 13 that lead to higher voxelIds last
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
  std::vector<int> start(count + 1, 0);
  BigVector<int> order(labels.size());
  for (const int label : labels) ++start[label + 1];
  for (int i = 0; i < count; ++i) start[i + 1] += start[i];
  std::vector<int> fill(start.begin(), start.end() - 1);
  for (int i = 0; i < static_cast<int>(labels.size()); ++i) order[fill[labels[i]]++] = i;
  std::vector<int> seen(count, -1);
  std::vector<std::pair<int, int>> edges;
  edges.reserve(static_cast<std::size_t>(count) * 8);  // of compact bodies; what is not used is never touched
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

VoidGraph mergeNearestFirst(const VoidGraph& graph, const ClusterRule& rule, std::vector<int>& merged_into) {
  Merging merging(graph, rule);
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
