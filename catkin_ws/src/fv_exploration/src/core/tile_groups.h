#pragma once
#include <tuple>
#include <utility>
#include <vector>

#include "fv_exploration/ellipsoid.h"
#include "tile_store.h"

namespace fv {

/// A label of a tile that neighbours something of another group.
struct Across {
  int own;    // part or node
  int tile;   // of the other group
  int label;  // of its frontier or its voids
  auto key() const { return std::tie(own, tile, label); }
  bool operator<(const Across& o) const { return key() < o.key(); }
  bool operator==(const Across& o) const { return key() == o.key(); }
};

/// What is known of 4x4x4 tiles without looking beyond them.
struct TileGroup {
  VoidGraph graph;                                     // what the voids of its tiles merge into
  std::vector<Ellipsoid> fits;                         // by node of it
  std::vector<int> node_of;                            // by void label of its tiles, one tile after the other
  int parts = 0;                                       // connected parts of its frontier
  std::vector<int> part_of;                            // by frontier component of its tiles
  std::vector<std::pair<int, int>> pairs;              // parts and nodes that neighbour each other, each once
  std::vector<Across> frontiers_across, voids_across;  // parts to frontiers, nodes to voids
  std::vector<Across> pairs_across;                    // parts to voids
};

/// All groups; what lies within those that did not change need not be looked at again. Their parts and nodes
/// have numbers, one group after the other.
class TileGroups {
 public:
  /// @param layout must outlive it.
  explicit TileGroups(const TileLayout& layout);

  /// Bring some groups up to date with their tiles. @param rule nullptr: voids have their clusters, merge
  /// none.
  void refresh(const std::vector<uint8_t>& stale, const TileStore& tiles, const ClusterRule* rule,
               int threads);

  const TileGroup& at(int group) const { return groups_[group]; }
  int count() const { return static_cast<int>(groups_.size()); }
  int parts() const { return part_start_.back(); }
  int nodes() const { return node_start_.back(); }
  int groupOf(int tile) const { return layout_.group_of[tile]; }
  int firstPart(int group) const { return part_start_[group]; }
  int firstNode(int group) const { return node_start_[group]; }
  int partOf(int tile, int component) const {
    const int group = layout_.group_of[tile];
    return part_start_[group] + groups_[group].part_of[first_component_[tile] + component];
  }
  int nodeOf(int tile, int label) const {
    const int group = layout_.group_of[tile];
    return node_start_[group] + groups_[group].node_of[first_label_[tile] + label];
  }

  /// Number the connected frontiers of all groups. @param[out] cluster_of by part. @return how many.
  int connectFrontiers(std::vector<int>& cluster_of) const;

 private:
  void mergeVoids(int group, const TileStore& tiles, const ClusterRule* rule);
  VoidGraph voidsOf(int group, int labels, const TileStore& tiles) const;
  void connectFrontier(int group, const TileStore& tiles);
  void listNeighbours(int group, const TileStore& tiles);

  const TileLayout& layout_;
  std::vector<TileGroup> groups_;
  std::vector<int> first_component_;  // by tile: number of its first component among those of its group
  std::vector<int> first_label_;      // by tile: number of its first void label among those of its group
  std::vector<int> part_start_{0}, node_start_{0};  // by group: its first among those of all groups
};

}  // namespace fv
