#include "fv_exploration/void_clusters.h"

#include <algorithm>
#include <numeric>

namespace fv {

namespace {

struct Pair {
  double squared_distance;
  uint64_t low_id, high_id;
  int a, b;
};
/// Order of a heap whose top is the nearest pair.
bool later(const Pair& p, const Pair& q) {
  if (p.squared_distance != q.squared_distance) return p.squared_distance > q.squared_distance;
  if (p.low_id != q.low_id) return p.low_id > q.low_id;
  return p.high_id > q.high_id;
}

/// Nodes that merge into new ones; the pairs that may still merge are in a heap.
class Merging {
 public:
  Merging(const VoidGraph& graph, const ClusterRule& rule)
      : rule_(rule), nodes_(graph.nodes), parent_(nodes_.size()), neighbours_(nodes_.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (const auto& [a, b] : graph.edges) {
      neighbours_[a].push_back(b);
      neighbours_[b].push_back(a);
      push(a, b);
    }
    std::make_heap(heap_.begin(), heap_.end(), later);
    heaped_ = true;
  }

  void run() {
    while (!heap_.empty()) {
      std::pop_heap(heap_.begin(), heap_.end(), later);
      const Pair pair = heap_.back();
      heap_.pop_back();
      if (parent_[pair.a] == pair.a && parent_[pair.b] == pair.b) merge(pair.a, pair.b);
    }
  }

  VoidGraph result(int node_count, std::vector<int>& merged_into) {
    std::vector<int> alive;
    for (int i = 0; i < static_cast<int>(nodes_.size()); ++i)
      if (parent_[i] == i) alive.push_back(i);
    std::sort(alive.begin(), alive.end(), [&](int a, int b) { return nodes_[a].id < nodes_[b].id; });
    std::vector<int> rank(nodes_.size(), -1);
    VoidGraph out;
    for (const int i : alive) {
      rank[i] = static_cast<int>(out.nodes.size());
      out.nodes.push_back(nodes_[i]);
    }
    for (const int i : alive)
      for (const int j : liveNeighbours(i))
        if (rank[i] < rank[j]) out.edges.emplace_back(rank[i], rank[j]);
    merged_into.resize(node_count);
    for (int i = 0; i < node_count; ++i) merged_into[i] = rank[find(i)];
    return out;
  }

 private:
  int find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  /// The nodes that the neighbours have become, each once, without itself.
  std::vector<int>& liveNeighbours(int i) {
    ++stamp_;
    seen_.resize(nodes_.size(), 0);
    seen_[i] = stamp_;
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
    Moments both = nodes_[a].moments;
    both += nodes_[b].moments;
    if (!(ellipsoidFit(both, rule_.model) >= rule_.min_fit)) return;  // never, unless one of them changes
    const auto [low, high] = std::minmax(nodes_[a].id, nodes_[b].id);
    // From the lower id to the higher, so that rounding does not depend on the order of building.
    const bool swap = nodes_[a].id != low;
    const Moments &first = nodes_[swap ? b : a].moments, &second = nodes_[swap ? a : b].moments;
    heap_.push_back({Moments::squaredDistance(first, second), low, high, a, b});
    if (heaped_) std::push_heap(heap_.begin(), heap_.end(), later);
  }

  void merge(int a, int b) {
    const int c = static_cast<int>(nodes_.size());
    VoidNode node = nodes_[a];
    node.moments += nodes_[b].moments;
    node.id = std::min(nodes_[a].id, nodes_[b].id);
    nodes_.push_back(node);
    parent_.push_back(c);
    parent_[a] = parent_[b] = c;
    std::vector<int> joined = std::move(neighbours_[a]);
    joined.insert(joined.end(), neighbours_[b].begin(), neighbours_[b].end());
    std::vector<int>().swap(neighbours_[b]);
    neighbours_.push_back(std::move(joined));
    for (const int j : liveNeighbours(c)) {
      neighbours_[j].push_back(c);
      push(c, j);
    }
  }

  const ClusterRule& rule_;
  std::vector<VoidNode> nodes_;
  std::vector<int> parent_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<Pair> heap_;
  bool heaped_ = false;
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

VoidGraph mergeNearestFirst(const VoidGraph& graph, const ClusterRule& rule, std::vector<int>& merged_into) {
  Merging merging(graph, rule);
  merging.run();
  return merging.result(static_cast<int>(graph.nodes.size()), merged_into);
}

VoidGraph seedEllipsoids(const std::vector<Voxel>& voxels, const ClusterRule& rule,
                         std::vector<int>& labels) {
  VoidGraph graph;
  labels.assign(voxels.size(), -1);
  if (voxels.empty()) return graph;
  LabelBox box(voxels);
  const auto attach = [&](int i) {
    const int label = static_cast<int>(graph.nodes.size());
    graph.nodes.push_back({{}, 0});
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
  for (int i = count - 1; i >= 0; --i) {
    labels[i] = box.cell[box.at[i]];
    graph.nodes[labels[i]].moments.add(voxels[i]);
    graph.nodes[labels[i]].id = voxelId(voxels[i]);  // ends with the smallest
  }
  graph.edges = labelEdges(box, labels, static_cast<int>(graph.nodes.size()));
  return graph;
}

VoidGraph clusterVoids(const std::vector<Voxel>& voxels, const ClusterRule& rule, std::vector<int>& labels) {
  std::vector<int> merged_into;
  const VoidGraph merged = mergeNearestFirst(seedEllipsoids(voxels, rule, labels), rule, merged_into);
  for (int& label : labels) label = merged_into[label];
  return merged;
}

}  // namespace fv
