#pragma once
#include <vector>

#include "tile_groups.h"

namespace fv {

/// Void clusters across groups.
class VoidJoin {
 public:
  /// A void cluster of nodes of several groups.
  struct Joined {
    int node;       ///< the first of them, among those of all groups
    VoidNode what;  ///< all of them together
    Ellipsoid fit;
  };

  /// Merge voids that neighbour each other across groups. Most nodes have no such neighbour with which they
  /// fit together, not even by way of others, and are done.
  /// @return how many nodes there were to merge.
  int update(const TileGroups& groups, const ClusterRule& rule);

  /// By node: the first node of its void cluster.
  const std::vector<int>& leader() const { return leader_; }
  /// By leader its ellipsoid, nullptr for other nodes; until groups or this change.
  std::vector<const Ellipsoid*> fits(const TileGroups& groups) const;

 private:
  void take(const std::vector<int>& number_of, const VoidGraph& merged, const std::vector<int>& merged_into,
            const EllipsoidModel& model);

  std::vector<int> leader_;
  std::vector<Joined> joined_;  // ascending by id
};

}  // namespace fv
