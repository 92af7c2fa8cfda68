#pragma once
#include <array>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "fv_exploration/convex_hull.h"
#include "fv_exploration/occupancy_map.h"
#include "fv_exploration/tile.h"
#include "fv_exploration/void_clusters.h"

namespace fv {

/// How a map is evaluated.
struct EvaluationConfig {
  double min_fit = 0.5;          ///< S (formula 3.2) that a merger of void ellipsoids needs, (0, 1]
  uint64_t seed = 0;             ///< of the random seed voxels
  double seed_share = 1.0 / 27;  ///< share of void voxels tried as first seeds, [0, 1]
  bool literal_formula = false;  ///< thesis formulas 3.1, 3.2 to the letter, see EllipsoidModel
  /// Merge within tiles of 16 voxels first, then within groups of 4x4x4 tiles, then all: what did not change
  /// need not be done again. Without it nearest pairs merge first everywhere, as in the thesis, anew in each
  /// update.
  bool tiled = true;
  int threads = 0;  ///< 0: all cores
  /// @throws InputError.
  void validate() const;
};

/// Neighbourhood of a void cluster: thesis 3.1.1, "the set of frontier-voids".
struct FrontierVoid {
  int ellipsoid;    ///< index into Evaluation::ellipsoids
  int first, last;  ///< its part of Evaluation::neighbour_clusters, first <= i < last
};

/// What an update found. Voxels are asked of the evaluator.
struct Evaluation {
  uint64_t map_sequence = 0;
  int64_t update = 0;                        ///< number of the update
  std::vector<Ellipsoid> ellipsoids;         ///< largest count first
  std::vector<FrontierVoid> frontier_voids;  ///< ellipsoids that neighbour a frontier, ascending
  std::vector<int> neighbour_clusters;       ///< per frontier-void its frontier clusters, ascending
  int clusters = 0;                          ///< number of frontier clusters
  std::map<std::string, int64_t> counts;     ///< frontier, void, tiles_stale (frontiers looked at anew), ...
  std::map<std::string, double> timings;     ///< [s]
  /// As new, but for the memory it holds.
  void clear() {
    ellipsoids.clear();
    frontier_voids.clear();
    neighbour_clusters.clear();
    counts.clear();
    timings.clear();
  }
};

/// Frontiers, voids, their clusters and their neighbourhoods, kept up to date with a map.
///
/// Frontier voxel: free, with an unknown 26-neighbour within the bounds (what lies beyond them is not
/// wanted). Void voxel: unknown, centre inside or on the convex hull of the centres of the occupied voxels.
/// Fewer than four occupied voxels, or all in a plane: no voids. After any sequence of changes the result is
/// that of a new evaluator, bit by bit.
class Evaluator {
 public:
  /// The map must outlive the evaluator. @throws InputError.
  Evaluator(const OccupancyMap& map, const EvaluationConfig& config);

  /// Bring everything up to date with the map; work is done where it changed.
  const Evaluation& update();

  const Evaluation& evaluation() const { return *evaluation_; }
  /// The same, and it stays as it is when the evaluator goes on.
  std::shared_ptr<const Evaluation> sharedEvaluation() const { return evaluation_; }
  const OccupancyMap& map() const { return map_; }
  const EvaluationConfig& config() const { return config_; }
  const HullRows& hull() const { return hull_; }
  ClusterRule rule() const;
  EllipsoidModel model() const { return rule().model; }

  /// Frontier voxels (N) tile by tile and the cluster of each.
  void frontier(std::vector<Voxel>& voxels, std::vector<int>& clusters) const;
  /// Void voxels (M) tile by tile and the ellipsoid of each.
  void voids(std::vector<Voxel>& voxels, std::vector<int>& ellipsoids) const;
  /// The ellipsoids that merging starts from, and the void voxel centres they stand for; computed anew at
  /// each call.
  std::vector<Ellipsoid> initialEllipsoids() const;

  /// Class in the low two bits, kFrontierFlag, kVoidFlag; by index of the frame.
  const GridFrame& frame() const { return frame_; }
  const std::vector<uint8_t>& flags() const { return flags_; }
  static constexpr uint8_t kClassMask = 3, kFrontierFlag = 4, kVoidFlag = 8;

 private:
  struct TileChange;
  struct StaleLinks;
  class Concerned;
  struct TileClasses {
    TileMask unknown{}, free{};  // the others are occupied, or outside
  };
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
  struct Group {
    std::vector<int> tiles;
    VoidGraph graph;                         // what the voids of its tiles merge into
    std::vector<Ellipsoid> fits;             // by node of it
    std::vector<int> node_of;                // by void label of its tiles, one tile after the other
    int parts = 0;                           // connected parts of its frontier
    std::vector<int> part_of;                // by frontier component of its tiles
    std::vector<std::pair<int, int>> pairs;  // parts and nodes that neighbour each other, each once
    std::vector<Across> frontiers_across, voids_across;  // parts to frontiers, nodes to voids
    std::vector<Across> pairs_across;                    // parts to voids
  };
  /// A void cluster of nodes of several groups.
  struct Joined {
    int node;       // the first of them, among those of all groups
    VoidNode what;  // all of them together
    Ellipsoid fit;
  };

  void reset();
  void nextEvaluation();
  void readChanges(std::vector<uint8_t>& frontiers, std::vector<uint8_t>& voids);
  void readTile(int tile, bool all_rows, TileChange& change);
  void noteRow(const Voxel& start, unsigned appeared, unsigned vanished, TileChange& change) const;
  void noteOccupied(const Voxel& v, bool occupied);
  void updateHull(std::vector<uint8_t>& stale);
  void markRow(const HullRows::Before& before, std::vector<uint8_t>& stale) const;
  TileMask frontierMask(int tile) const;
  TileMask voidMask(int tile) const;
  void refreshFrontiers(const std::vector<uint8_t>& stale, std::vector<uint8_t>& stale_voids);
  void refreshVoids(const std::vector<uint8_t>& stale);
  template <class Label>
  int refresh(int tile, LabelledMask Tile::*part, const TileMask& mask, uint8_t flag, const Label& label);
  int refreshFrontier(int tile);
  int refreshVoid(int tile);
  void writeFlags(int tile, const TileMask& before, const TileMask& after, uint8_t flag);
  void relinkTiles(std::vector<uint8_t>& stale_groups);
  void relinkTile(int tile, const StaleLinks& stale);
  void refreshGroups(const std::vector<uint8_t>& stale);
  void mergeGroup(Group& group);
  void fitGroup(Group& group, const VoidGraph& before);
  void connectGroup(Group& group);
  void listNeighbours(Group& group);
  void numberFrontiers();
  void clusterWhole();
  void joinAcross();
  void takeJoined(const std::vector<int>& node_of, const VoidGraph& merged,
                  const std::vector<int>& merged_into);
  void rankEllipsoids();
  void pairFrontierVoids();
  int nodeOf(int tile, int label) const {
    const int group = group_of_[tile];
    return node_start_[group] + groups_[group].node_of[first_label_[tile] + label];
  }
  int partOf(int tile, int component) const {
    const int group = group_of_[tile];
    return part_start_[group] + groups_[group].part_of[first_component_[tile] + component];
  }
  std::array<int, 27> neighbours(int tile) const;
  Voxel tileCorner(int tile) const { return frame_.origin + frame_.tile(tile) * kTile; }

  const OccupancyMap& map_;
  EvaluationConfig config_;
  GridFrame frame_;
  std::vector<uint8_t> flags_;
  RowExtremes occupied_rows_;
  HullRows hull_;
  bool hull_shrinks_ = false;           // it must be made anew
  std::vector<Voxel> hull_grows_;       // voxels that became occupied outside of it
  std::vector<uint64_t> hull_corners_;  // voxelIds, ascending
  std::vector<TileClasses> classes_;    // by tile; as the flags, but near each other in memory
  std::vector<std::unique_ptr<Tile>> tiles_;
  std::array<int, 27> step_to_{};  // of tile indices, by direction
  int64_t frontier_voxels_ = 0, void_voxels_ = 0;
  // By tile: directions whose tiles see labels that this update has changed.
  std::vector<uint32_t> frontier_touched_, void_touched_;
  std::vector<int> components_;       // by tile: components of its frontier
  std::vector<int> first_component_;  // by tile: number of its first component among those of its group
  std::vector<int> labels_;           // by tile: labels of its voids
  std::vector<int> first_label_;      // by tile: number of its first void label among those of its group
  std::vector<int> group_of_;         // by tile
  std::vector<Group> groups_;
  std::vector<int> part_start_, node_start_;  // by group: its first among those of all groups
  std::vector<int> cluster_of_;               // by part: its frontier cluster
  std::vector<int> leader_;                   // by node: the first node of its void cluster
  std::vector<int> ellipsoid_of_;             // by node
  std::vector<Joined> joined_;                // ascending by id
  std::vector<std::vector<int>> whole_;       // when voids are not tiled: by tile and label the ellipsoid
  uint64_t seen_sequence_ = 0;
  std::shared_ptr<Evaluation> evaluation_ = std::make_shared<Evaluation>();
  std::shared_ptr<Evaluation> spare_;  // an earlier one, for its memory
};

}  // namespace fv
