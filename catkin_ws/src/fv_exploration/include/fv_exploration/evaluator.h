#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fv_exploration/ellipsoid.h"
#include "fv_exploration/occupancy_map.h"

namespace fv {

struct ClusterRule;
struct HullRows;

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
  ~Evaluator();

  /// Bring everything up to date with the map; work is done where it changed.
  const Evaluation& update();

  const Evaluation& evaluation() const { return *evaluation_; }
  /// The same, and it stays as it is when the evaluator goes on.
  std::shared_ptr<const Evaluation> sharedEvaluation() const { return evaluation_; }
  const OccupancyMap& map() const { return map_; }
  const EvaluationConfig& config() const { return config_; }
  const HullRows& hull() const;

  /// Frontier voxels (N) tile by tile and the cluster of each.
  void frontier(std::vector<Voxel>& voxels, std::vector<int>& clusters) const;
  /// Void voxels (M) tile by tile and the ellipsoid of each.
  void voids(std::vector<Voxel>& voxels, std::vector<int>& ellipsoids) const;
  /// The ellipsoids that merging starts from, and the void voxel centres they stand for; computed anew at
  /// each call.
  std::vector<Ellipsoid> initialEllipsoids() const;

  /// Class in the low two bits, kFrontierFlag, kVoidFlag; by index of the frame.
  const GridFrame& frame() const;
  const std::vector<uint8_t>& flags() const;

 private:
  struct Parts;
  ClusterRule rule() const;
  Evaluation& nextEvaluation();
  void joinVoids(const ClusterRule& rule, Evaluation& out);
  void takeWhole(const std::vector<std::vector<int>>& whole);

  const OccupancyMap& map_;
  EvaluationConfig config_;
  std::unique_ptr<Parts> parts_;
  std::shared_ptr<Evaluation> evaluation_ = std::make_shared<Evaluation>();
  std::shared_ptr<Evaluation> spare_;  // an earlier one, for its memory
};

}  // namespace fv
