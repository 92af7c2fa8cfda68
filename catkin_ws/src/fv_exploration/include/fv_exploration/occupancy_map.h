#pragma once
#include <array>
#include <bitset>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "fv_exploration/errors.h"
#include "fv_exploration/occupancy_tree.h"
#include "fv_exploration/scan_marks.h"

namespace fv {

/// What an OccupancyMap is made with. Probabilities as OctoMap's.
struct MapConfig {
  double resolution_m = 0.05;  ///< edge of a voxel [m], 0.001 to 10
  /// Corners of the exploration volume [m], map frame: voxels whose centre lies in it are mapped, no others.
  /// Both or neither; without them the map grows as needed.
  std::optional<std::array<double, 3>> bounds_min;
  std::optional<std::array<double, 3>> bounds_max;
  double prob_hit = 0.7;             ///< [0.5, 1)
  double prob_miss = 0.4;            ///< (0, 0.5]
  double clamp_min = 0.12;           ///< (0, 1), below clamp_max
  double clamp_max = 0.97;           ///< (0, 1)
  double occupancy_threshold = 0.5;  ///< occupied from here on, [clamp_min, clamp_max]
  int threads = 0;                   ///< 0: all cores
  double dense_limit_mb = 512;  ///< largest grid that a scan's rays are marked in; above it blocks are used

  /// @throws InputError naming the value and its valid range.
  void validate() const;
};

/// Which returns count, and what a ray without one says.
struct ScanConfig {
  double min_range_m = 0.0;  ///< nearer returns are dropped with their ray [m]
  double max_range_m = std::numeric_limits<double>::infinity();  ///< farther ones clear up to here only [m]
  double no_return_clear_m = 0.0;  ///< rays without return clear up to here [m]; 0: they say nothing
  void validate() const;
};

/// What one change of the map did.
struct InsertResult {
  std::vector<Change> changes;  ///< voxels whose class changed
  /// Of a scan's points: points, and of these dropped with their ray: no_return (unless they clear), absurd,
  /// near; rays, of these hits, far (they clear up to the largest range), outside (end beyond the octree's
  /// keys). Of voxels: free and occupied (marked so), changed.
  std::map<std::string, int64_t> counts;
  std::map<std::string, double> timings;  ///< [s]: rays, mark, tree, classes, total
  uint64_t sequence = 0;                  ///< of the map, afterwards
};

/// The occupancy map: an OctoMap octree, and beside it the class of each voxel in a dense grid.
///
/// Outside of the bounds everything is unknown and stays so. Not safe for calls from several threads at once.
class OccupancyMap {
 public:
  /// @throws InputError as MapConfig::validate.
  explicit OccupancyMap(const MapConfig& config);
  OccupancyMap(const OccupancyMap& other);

  /// Read a .bt or .ot file of an OcTree.
  /// @param config what to do with later scans. Its resolution must be the file's; bounds cut the file's
  /// voxels.
  /// @throws MapFileError, InputError.
  static std::unique_ptr<OccupancyMap> read(const std::string& path, const MapConfig* config);

  /// Insert a scan: the classes, log odds and pruning that OcTree::insertPointCloud(lazy_eval = false,
  /// discretize = false) gives for the cloud in the map frame, cut to the bounds.
  /// @param points_sensor (N, 3) [m], sensor frame; rows that are not finite had no return. Ranges below
  /// kNearestReturn or above kFarthestReturn are dropped with their ray.
  /// @param T_map_sensor  rigid (4, 4), takes sensor-frame points to the map frame.
  /// @param directions_sensor (N, 3) where each row looks, of any length; (0, 3) when unknown. Needed for
  /// rays without
  ///        return to clear anything.
  /// @throws InputError for shapes that do not match or a transform that is not rigid, OutsideKeysError for a
  /// sensor beyond the octree's keys; the map is unchanged then.
  InsertResult insertScan(const Eigen::Ref<const Points>& points_sensor, const Eigen::Matrix4d& T_map_sensor,
                          const ScanConfig& scan, const Eigen::Ref<const Points>& directions_sensor);

  /// Insert rays that are already in the map frame; `max_range_m` as OctoMap's maxrange, negative for none.
  InsertResult insertRays(ScanRays rays, double max_range_m);

  /// Set the voxels of these points (N, 3) [m] free, as certainly as clamping allows; others than finite
  /// points inside the bounds are passed over. Space that somebody vouches for.
  InsertResult markFree(const Eigen::Ref<const Points>& points);

  /// (N,) -1 unknown, 0 free, 1 occupied. Points outside the bounds or not finite are unknown.
  std::vector<int8_t> classify(const Eigen::Ref<const Points>& points) const;

  Class classOf(const Voxel& v) const {
    return frame_.contains(v) ? Class(classes_[frame_.index(v)]) : absent();
  }
  /// Centres (N, 3) [m] of all voxels of a class at leaf resolution, ascending with z, y, x. kUnknown needs
  /// bounds.
  PointsF voxels(Class which) const;
  /// Voxels of the class; kUnknown: those within the bounds, 0 without bounds.
  int64_t count(Class which) const;
  /// Known share of the bounded volume, 0 to 1. @throws InputError without bounds.
  double knownShare() const;
  /// Volume of the bounds' voxels [m^3]. @throws InputError without bounds.
  double volume() const;

  /// OcTree::writeBinaryData of a copy at maximum likelihood, pruned: payload of a binary
  /// octomap_msgs/Octomap.
  std::string binaryData() const;
  /// OcTree::writeData: payload of a full octomap_msgs/Octomap.
  std::string fullData() const;
  /// @throws MapFileError when the file cannot be written.
  void writeBt(const std::string& path) const;
  void writeOt(const std::string& path) const;

  /// Grows by one with each change; 0 for a new map.
  uint64_t sequence() const { return sequence_; }
  double resolution() const { return config_.resolution_m; }
  const MapConfig& config() const { return config_; }
  bool bounded() const { return config_.bounds_min.has_value(); }
  const VoxelBox& bounds() const { return bounds_; }
  const OccupancyTree& tree() const { return *tree_; }
  const GridFrame& frame() const { return frame_; }
  const std::vector<uint8_t>& classes() const { return classes_; }
  /// Sequence at which a tile of the frame last changed.
  const std::vector<uint64_t>& tileSequences() const { return tile_sequences_; }
  /// Rows along x of a tile, by y + 16 z, that changed when the tile last changed.
  using RowSet = std::bitset<kTile * kTile>;
  const RowSet& changedRows(int tile) const { return changed_rows_[tile]; }
  Eigen::Vector3d centre(const Voxel& v) const { return (v.cast<double>().array() + 0.5) * resolution(); }
  bool voxelAt(const Eigen::Vector3d& point, Voxel& v) const;
  int threads() const;

 private:
  void makeTree();
  void layOut(const Voxel& min, const Voxel& max);
  void makeRoom(const Voxel& min, const Voxel& max);
  void fillOutside();
  void requireInKeys(const Eigen::Vector3d& sensor) const;
  void record(const std::vector<Change>& changes);
  void adopt(const octomap::OcTree& tree);
  InsertResult finish(std::vector<Change> changes, InsertResult result);
  Class absent() const { return bounded() ? kOutside : kUnknown; }

  MapConfig config_;
  VoxelBox bounds_;
  std::unique_ptr<OccupancyTree> tree_;
  GridFrame frame_;
  std::vector<uint8_t> classes_;  // Class by frame index
  std::vector<uint64_t> tile_sequences_;
  std::vector<RowSet> changed_rows_;  // by tile
  std::array<int64_t, 4> counts_{};
  uint64_t sequence_ = 0;
};

}  // namespace fv
