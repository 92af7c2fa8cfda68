#pragma once
#include <octomap/OcTree.h>

#include <cstdint>
#include <vector>

#include "fv_exploration/grid.h"

namespace fv {

constexpr int kBlock = 8;  ///< edge of a block of marks [voxels]; a node three levels above the leaves
constexpr int kBlockVoxels = kBlock * kBlock * kBlock;

/// What a scan says of a voxel: nothing, passed by a ray, or hit by one.
enum Mark : uint8_t { kNoMark = 0, kMiss = 1, kHit = 2 };

/// Marks of the voxels of one block.
struct MarkBlock {
  Voxel block;                  ///< block coordinates: lowest voxel / kBlock
  uint8_t marks[kBlockVoxels];  ///< in the order of octree children: three levels of x + 2 y + 4 z
};

/// A voxel whose class changed.
struct Change {
  Voxel voxel;
  Class before;
  Class after;
};

/// octomap::OcTree with updates of many voxels at a time; always as pruned as updateNode with lazy_eval =
/// false.
class OccupancyTree : public octomap::OcTree {
 public:
  explicit OccupancyTree(double resolution_m);
  OccupancyTree(const OccupancyTree& other) = default;

  /// Update every marked voxel once by a hit or a miss, as OcTree::updateNode(key, hit, false) for each would
  /// do.
  /// @param blocks each block at most once.
  /// @return voxels whose class changed, in the order of the blocks; the same for any number of threads.
  std::vector<Change> apply(std::vector<MarkBlock>& blocks, int threads);

  /// Give a box of voxels, ends included, of which nothing is known yet, log odds; they are clamped.
  /// @return what its voxels are then.
  Class fillBox(const Voxel& min, const Voxel& max, float log_odds);

  Class classOf(const octomap::OcTreeNode* node) const;
  octomap::OcTreeKey key(const Voxel& v) const;

 private:
  struct Task;
  struct Descent;
  bool makeRoot();
  void open(octomap::OcTreeNode* node, bool created, Descent& descent, int begin, int end, int depth);
  void close(octomap::OcTreeNode* node, const Descent& descent, int begin, int end, int depth);
  octomap::OcTreeNode* child(octomap::OcTreeNode* node, bool node_created, int i, bool& created);
  bool settled(const octomap::OcTreeNode* node, const uint8_t* marks, int count) const;
  void update(octomap::OcTreeNode* node, bool created, const uint8_t* marks, int count, const Voxel& corner,
              std::vector<Change>& changes);
  void fillBelow(octomap::OcTreeNode* node, bool created, const Voxel& low, int edge, const Voxel& min,
                 const Voxel& max, float log_odds);
  void updateLeaf(octomap::OcTreeNode* node, bool created, uint8_t mark, const Voxel& voxel,
                  std::vector<Change>& changes);
};

}  // namespace fv
