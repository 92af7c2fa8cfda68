#include "void_clusters.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "candidate_queue.h"
#include "fv_exploration/errors.h"

namespace fv {

namespace {

/// Nodes in the order of their ids that merge into the lower one. A node keeps only the nearest of its higher
/// neighbours and waits with that: most pairs are never looked at.
class Merging {
 public:
  Merging(const VoidGraph& graph, const ClusterRule& rule)
      : rule_(rule), slot_(graph.nodes.size()), queue_(graph.nodes.size()) {
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
      sums_.push_back(graph.nodes[i].moments);
      nodes_.emplace_back(slot_[i], sums_.back());
    }
    link(graph);
  }

  /// A candidate's partner is the nearest, but need not fit: that is found out when its turn has come. If the
  /// nearest was lost, or does not fit, the node waits anew with the next.
  void run() {
    for (Candidate next; queue_.pop(next);) {
      fetchAhead();
      if (!current(next)) continue;
      const int i = next.node, partner = nodes_[i].partner;
      if (partner == kLost)
        lookAround(i, [](int) { return true; });
      else if (fit(i, partner))
        merge(i, partner);
      else
        lookAround(i, [&](int j) { return j != partner && fit(i, j); });
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
  static constexpr int kNone = -1, kLost = -2;
  /// All that its neighbours ask of a node, in one line of the cache.
  struct alignas(64) Node {
    int parent;              // itself, or a node that it has become a part of
    int seen = 0;            // number of the last look around that has met it
    Eigen::Vector3d mean;    // as Moments has it, without the half voxel
    double nearest = kFar;   // squared distance to the partner; no higher neighbour that fits is nearer
    int partner = kNone;     // a higher neighbour; kLost: not known who, kNone: nobody fits
    int size = 0, room = 0;  // of its list of neighbours
    int* list = nullptr;
    Node(int self, const Moments& m)
        : parent(self), mean(Eigen::Vector3d(m.sum[0], m.sum[1], m.sum[2]) / static_cast<double>(m.n)) {}
  };
  static constexpr double kFar = std::numeric_limits<double>::infinity();

  void link(const VoidGraph& graph) {
    const std::size_t count = nodes_.size();
    std::vector<int> end(count + 1, 0);  // of each node's list, while it is filled
    for (const auto& [a, b] : graph.edges) {
      ++end[slot_[a] + 1];
      ++end[slot_[b] + 1];
    }
    std::partial_sum(end.begin(), end.end(), end.begin());
    lists_.resize(end.back());
    for (std::size_t i = 0; i < count; ++i) {
      nodes_[i].list = lists_.data() + end[i];
      nodes_[i].room = nodes_[i].size = end[i + 1] - end[i];
    }
    const auto fill = [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const int a = slot_[graph.edges[i].first], b = slot_[graph.edges[i].second];
        lists_[end[a]++] = b;
        lists_[end[b]++] = a;
      }
    };
    fill(0, graph.settled);
    const std::vector<int> open(end.begin(), end.end() - 1);  // where neighbours begin that may fit
    fill(graph.settled, graph.edges.size());
    for (int i = 0; i < static_cast<int>(count); ++i) {
      const int *first = lists_.data() + open[i], *last = lists_.data() + end[i];
      choose(i, first, last, [](int) { return true; });
      const int partner = nodes_[i].partner;
      if (partner != kNone && !fit(i, partner))
        choose(i, first, last, [&](int j) { return j != partner && fit(i, j); });
      wait(i);
    }
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
      const Node& node = nodes_[i];
      for (int k = 0; k < node.size; ++k) __builtin_prefetch(&nodes_[node.list[k]]);  // they lie scattered
      for (int k = 0; k < node.size; ++k) {
        const int j = find(node.list[k]);
        if (nodes_[j].seen == stamp_) continue;
        nodes_[j].seen = stamp_;
        live_.push_back(j);
      }
      if (a == b) break;
    }
    return live_;
  }

  bool current(const Candidate& c) const {
    const Node& node = nodes_[c.node];
    return node.parent == c.node && node.nearest == c.squared_distance;
  }
  bool fit(int a, int b) const { return rule_.accepts(sums_[a] + sums_[b]); }
  /// As Moments has it, to the last bit.
  double squaredDistance(int a, int b) const {
    const Eigen::Vector3d d = nodes_[a].mean - nodes_[b].mean;
    return d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
  }
  /// Whether a higher node at that distance would be the partner of this one.
  static bool nearer(const Node& node, double squared_distance, int high) {
    return squared_distance < node.nearest || (squared_distance == node.nearest && high < node.partner);
  }

  /// Find the nearest of a node anew, of those for which a condition holds.
  template <class Condition>
  void lookAround(int i, const Condition& condition) {
    const std::vector<int>& around = liveNeighbours(i, i);
    Node& node = nodes_[i];
    node.size = static_cast<int>(around.size());
    std::copy(around.begin(), around.end(), node.list);
    choose(i, around.data(), around.data() + around.size(), condition);
    wait(i);
  }

  /// The nearest of a node among some of its neighbours.
  template <class Condition>
  void choose(int i, const int* begin, const int* end, const Condition& condition) {
    Node& node = nodes_[i];
    node.nearest = kFar;
    node.partner = kNone;
    for (const int* j = begin; j != end; ++j)
      if (i < *j) {
        const double squared_distance = squaredDistance(i, *j);
        if (nearer(node, squared_distance, *j) && condition(*j)) {
          node.nearest = squared_distance;
          node.partner = *j;
        }
      }
  }
  void wait(int i) {
    if (nodes_[i].partner != kNone) queue_.push({nodes_[i].nearest, i});
  }

  /// Ask for what the next mergers will read, each in time for the next: the node, its partner and sums,
  /// their lists, the nodes in these. Always inline: calls of a function that only asks are dropped.
  [[gnu::always_inline]] void fetchAhead() const {
    const auto each = [&](std::size_t steps, const auto& fetch) {
      const Candidate* c = queue_.ahead(steps);
      if (!c || !current(*c)) return;
      const Node& node = nodes_[c->node];
      fetch(node, node.partner >= 0 ? nodes_[node.partner] : node);
    };
    if (const Candidate* c = queue_.ahead(10)) __builtin_prefetch(&nodes_[c->node]);
    each(8, [&](const Node& node, const Node& partner) {
      __builtin_prefetch(&partner);
      fetchSums(node.parent);
      if (node.partner >= 0) fetchSums(node.partner);
      fetchList(node);
    });
    each(6, [&](const Node& node, const Node& partner) {
      fetchList(partner);
      fetchNodes(node);
    });
    each(3, [&](const Node&, const Node& partner) { fetchNodes(partner); });
  }
  [[gnu::always_inline]] static void fetchList(const Node& node) {
    __builtin_prefetch(node.list);
    __builtin_prefetch(node.list + node.size);
  }
  [[gnu::always_inline]] void fetchNodes(const Node& node) const {
    for (int k = 0; k < node.size; ++k) __builtin_prefetch(&nodes_[node.list[k]]);
  }
  [[gnu::always_inline]] void fetchSums(int i) const {
    __builtin_prefetch(&sums_[i]);
    __builtin_prefetch(reinterpret_cast<const char*>(&sums_[i] + 1) - 1);
  }

  void merge(int low, int high) {
    sums_[low] += sums_[high];
    const std::vector<int>& around = liveNeighbours(low, high);  // they know it by the names of its parts
    nodes_[high].parent = low;
    nodes_[low].mean = Node(low, sums_[low]).mean;
    keepList(nodes_[low], nodes_[high], around);
    // First whose partner it may become, so that all their sums are on their way together.
    nearby_.clear();
    for (const int j : around) {
      Node& node = nodes_[j];
      if (node.partner == low || node.partner == high) node.partner = kLost;
      if (j > low || !nearer(node, squaredDistance(j, low), low)) continue;
      fetchSums(j);
      nearby_.push_back(j);
    }
    choose(low, around.data(), around.data() + around.size(), [](int) { return true; });
    wait(low);
    for (const int j : nearby_)  // tried now: who has many neighbours must not look for another each time
      if (fit(j, low)) {
        nodes_[j].nearest = squaredDistance(j, low);
        nodes_[j].partner = low;
        wait(j);
      }
  }

  /// Write the neighbours of two merged nodes where one of them had its own, or where there is room.
  void keepList(Node& low, Node& high, const std::vector<int>& around) {
    if (low.room < high.room) {
      std::swap(low.list, high.list);
      std::swap(low.room, high.room);
    }
    low.size = static_cast<int>(around.size());
    high.size = 0;
    if (low.room < low.size) {
      low.room = 2 * low.size;
      rooms_.emplace_back(low.room);
      low.list = rooms_.back().data();
    }
    std::copy(around.begin(), around.end(), low.list);
  }

  const ClusterRule& rule_;
  std::vector<int> slot_;  // per node of the graph its place here
  std::vector<uint64_t> ids_;
  BigVector<Moments> sums_;
  BigVector<Node> nodes_;
  BigVector<int> lists_;                 // neighbours as the graph has them
  std::vector<std::vector<int>> rooms_;  // for lists that have outgrown these
  CandidateQueue queue_;
  std::vector<int> live_;    // of liveNeighbours
  std::vector<int> nearby_;  // of merge
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
    const double cells = dims.cast<double>().prod();
    require(cells < 2147483648.0, "volume of the box around the voxels", cells, "below 2^31");
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
