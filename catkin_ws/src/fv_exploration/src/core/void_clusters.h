#pragma once
#include <utility>
#include <vector>

#include "big_vector.h"
#include "fv_exploration/ellipsoid.h"

namespace fv {

/// When void voxels become one cluster: the one place that says it.
struct ClusterRule {
  EllipsoidModel model;
  double min_fit = 0.5;            ///< S that a merger needs, (0, 1]
  uint64_t seed = 0;               ///< of the random seed voxels
  double seed_share = 1.0 / 27.0;  ///< share of the voxels tried as first seeds
  /// Whether voxels with these moments, those of two neighbours together, may be one cluster.
  bool accepts(const Moments& together) const { return ellipsoidFit(together, model) >= min_fit; }
};

/// A void cluster in the making.
struct VoidNode {
  Moments moments;
  uint64_t id;  ///< smallest voxelId in it: breaks ties, the same in every order of building
  bool operator==(const VoidNode& o) const { return id == o.id && moments == o.moments; }
};

/// A graph of neighbouring nodes: edges (a < b), each once.
struct VoidGraph {
  BigVector<VoidNode> nodes;
  std::vector<std::pair<int, int>> edges;
  std::size_t settled = 0;  ///< the first so many edges join nodes that are known not to fit together
};

/// Merge neighbours nearest first (by centroid; ties by id) as long as a merger has S >= min_fit; each node
/// waits with its nearest neighbour.
/// @param[out] merged_into per node of `graph` its node in the result.
/// @return the merged graph, nodes ascending by id, all its edges settled.
VoidGraph mergeNearestFirst(const VoidGraph& graph, const ClusterRule& rule, std::vector<int>& merged_into);

/// Seed voxels in random order with their unattached neighbours, then all that are left likewise
/// (thesis 3.1.1); nodes ascending by id.
/// @param voxels each once, ascending by voxelId.
/// @param[out] labels per voxel its node.
VoidGraph seedEllipsoids(const std::vector<Voxel>& voxels, const ClusterRule& rule, std::vector<int>& labels);

/// Seeding and merging of a set of voxels: the thesis's procedure as a whole.
VoidGraph clusterVoids(const std::vector<Voxel>& voxels, const ClusterRule& rule, std::vector<int>& labels);

}  // namespace fv
