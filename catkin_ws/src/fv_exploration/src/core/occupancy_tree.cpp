#include "fv_exploration/occupancy_tree.h"

#include <algorithm>
#include <cstring>
#include <memory>

#include "concatenate.h"
#include "parallel.h"

namespace fv {

using octomap::OcTreeNode;

namespace {

constexpr int kBlockDepth = 13;  // 16 levels, a block spans the last three

/// Interleaved bits of a block's coordinates: sorted by them, the blocks below a node are contiguous.
uint64_t mortonOf(const Voxel& block) {
  uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const uint64_t c = static_cast<uint64_t>(block[axis] + kKeyOffset / kBlock);
    for (int bit = 0; bit < kBlockDepth; ++bit) code |= (c >> bit & 1) << (3 * bit + axis);
  }
  return code;
}

int childIndex(uint64_t morton, int depth) { return morton >> (3 * (kBlockDepth - 1 - depth)) & 7; }

bool anyMark(const uint8_t* marks, int count) {
  for (int i = 0; i < count; i += 8) {
    uint64_t word;
    std::memcpy(&word, marks + i, 8);
    if (word) return true;
  }
  return false;
}

}  // namespace

/// A block's node; nullptr when nothing can change there.
struct OccupancyTree::Task {
  OcTreeNode* node = nullptr;
  bool created = false;
};

/// The blocks in Morton order, their codes and tasks.
struct OccupancyTree::Descent {
  const std::vector<MarkBlock>& blocks;
  std::vector<uint64_t> codes;
  std::vector<Task> tasks;

  /// End of the run of blocks below the child that block `begin` is in.
  int runEnd(int begin, int end, int depth) const {
    const int shift = 3 * (kBlockDepth - 1 - depth);
    const uint64_t next = ((codes[begin] >> shift) + 1) << shift;
    return static_cast<int>(std::lower_bound(codes.begin() + begin, codes.begin() + end, next) -
                            codes.begin());
  }
};

OccupancyTree::OccupancyTree(double resolution_m) : OcTree(resolution_m) { clearKeyRays(); }

Class OccupancyTree::classOf(const OcTreeNode* node) const {
  if (!node) return kUnknown;
  return isNodeOccupied(node) ? kOccupied : kFree;
}

octomap::OcTreeKey OccupancyTree::key(const Voxel& v) const {
  return {static_cast<octomap::key_type>(v.x() + kKeyOffset),
          static_cast<octomap::key_type>(v.y() + kKeyOffset),
          static_cast<octomap::key_type>(v.z() + kKeyOffset)};
}

OcTreeNode* OccupancyTree::child(OcTreeNode* node, bool node_created, int i, bool& created) {
  created = false;
  if (!nodeChildExists(node, i)) {
    if (!nodeHasChildren(node) && !node_created) {
      expandNode(node);
    } else {
      createNodeChild(node, i);
      created = true;
    }
  }
  return getNodeChild(node, i);
}

/// Would no mark change the value of this pruned leaf? As the early abort of OcTree::updateNode.
bool OccupancyTree::settled(const OcTreeNode* node, const uint8_t* marks, int count) const {
  const bool low = node->getLogOdds() <= clamping_thres_min, high = node->getLogOdds() >= clamping_thres_max;
  if (!low && !high) return false;
  const uint8_t harmless = low ? kMiss : kHit;
  return std::all_of(marks, marks + count, [&](uint8_t m) { return m == kNoMark || m == harmless; });
}

void OccupancyTree::open(OcTreeNode* node, bool created, Descent& descent, int begin, int end, int depth) {
  if (!created && !nodeHasChildren(node) &&
      std::all_of(descent.blocks.begin() + begin, descent.blocks.begin() + end,
                  [&](const MarkBlock& b) { return settled(node, b.marks, kBlockVoxels); }))
    return;
  if (depth == kBlockDepth) {
    descent.tasks[begin] = {node, created};
    return;
  }
  for (int first = begin; first < end;) {
    const int last = descent.runEnd(first, end, depth);
    bool child_created;
    OcTreeNode* next = child(node, created, childIndex(descent.codes[first], depth), child_created);
    open(next, child_created, descent, first, last, depth + 1);
    first = last;
  }
}

void OccupancyTree::close(OcTreeNode* node, const Descent& descent, int begin, int end, int depth) {
  if (depth == kBlockDepth || !nodeHasChildren(node)) return;
  for (int first = begin; first < end;) {
    const int last = descent.runEnd(first, end, depth);
    close(getNodeChild(node, childIndex(descent.codes[first], depth)), descent, first, last, depth + 1);
    first = last;
  }
  if (!pruneNode(node)) node->updateOccupancyChildren();
}

void OccupancyTree::updateLeaf(OcTreeNode* node, bool created, uint8_t mark, const Voxel& voxel,
                               std::vector<Change>& changes) {
  const Class before = created ? kUnknown : classOf(node);
  updateNodeLogOdds(node, mark == kHit ? prob_hit_log : prob_miss_log);
  const Class after = classOf(node);
  if (before != after) changes.push_back({voxel, before, after});
}

void OccupancyTree::update(OcTreeNode* node, bool created, const uint8_t* marks, int count,
                           const Voxel& corner, std::vector<Change>& changes) {
  if (!created && !nodeHasChildren(node) && settled(node, marks, count)) return;
  const int part = count / 8, half = count == 512 ? 4 : count == 64 ? 2 : 1;
  for (int i = 0; i < 8; ++i) {
    const uint8_t* sub = marks + i * part;
    if (part == 1 ? *sub == kNoMark : !anyMark(sub, part)) continue;
    bool child_created;
    OcTreeNode* next = child(node, created, i, child_created);
    created = false;  // it has a child now
    const Voxel at = corner + half * Voxel(i & 1, i >> 1 & 1, i >> 2);
    if (part == 1)
      updateLeaf(next, child_created, *sub, at, changes);
    else
      update(next, child_created, sub, part, at, changes);
  }
  if (!pruneNode(node)) node->updateOccupancyChildren();
}

Class OccupancyTree::fillBox(const Voxel& min, const Voxel& max, float log_odds) {
  const float clamped = std::clamp(log_odds, clamping_thres_min, clamping_thres_max);
  const bool new_root = makeRoot();
  fillBelow(root, new_root, Voxel::Constant(-kKeyOffset), 2 * kKeyOffset, min, max, clamped);
  return clamped >= occ_prob_thres_log ? kOccupied : kFree;
}

/// @param low lowest voxel of the node, @param edge of it in voxels.
void OccupancyTree::fillBelow(OcTreeNode* node, bool created, const Voxel& low, int edge, const Voxel& min,
                              const Voxel& max, float log_odds) {
  if ((low.array() >= min.array()).all() && (low.array() + (edge - 1) <= max.array()).all()) {
    node->setLogOdds(log_odds);
    return;
  }
  const int half = edge / 2;
  for (int i = 0; i < 8; ++i) {
    const Voxel part = low + half * Voxel(i & 1, i >> 1 & 1, i >> 2);
    if ((part.array() > max.array()).any() || (part.array() + (half - 1) < min.array()).any()) continue;
    bool child_created;
    OcTreeNode* next = child(node, created, i, child_created);
    fillBelow(next, child_created, part, half, min, max, log_odds);
  }
  if (!pruneNode(node)) node->updateOccupancyChildren();
}

/// @return whether there was none before.
bool OccupancyTree::makeRoot() {
  if (root) return false;
  root = new OcTreeNode();
  tree_size++;
  return size_changed = true;
}

std::vector<Change> OccupancyTree::apply(std::vector<MarkBlock>& blocks, int threads) {
  if (blocks.empty()) return {};
  std::sort(blocks.begin(), blocks.end(),
            [](const MarkBlock& a, const MarkBlock& b) { return mortonOf(a.block) < mortonOf(b.block); });
  Descent descent{blocks, {}, {}};
  for (const MarkBlock& b : blocks) descent.codes.push_back(mortonOf(b.block));
  const int count = static_cast<int>(blocks.size());
  descent.tasks.resize(count);
  const bool new_root = makeRoot();
  open(root, new_root, descent, 0, count, 0);
  // Nodes belong to no tree: workers below disjoint nodes count what they create in a tree of their own.
  std::vector<std::unique_ptr<OccupancyTree>> counters;
  for (int i = 0; i < threads; ++i) {
    counters.push_back(std::make_unique<OccupancyTree>(resolution));
    OccupancyTree& c = *counters.back();
    c.clamping_thres_min = clamping_thres_min;
    c.clamping_thres_max = clamping_thres_max;
    c.prob_hit_log = prob_hit_log;
    c.prob_miss_log = prob_miss_log;
    c.occ_prob_thres_log = occ_prob_thres_log;
  }
  constexpr int kChunk = 16;
  std::vector<std::vector<Change>> parts((count + kChunk - 1) / kChunk);
  parallelChunks(count, threads, kChunk, [&](int begin, int end, int thread) {
    for (int i = begin; i < end; ++i) {
      const Task& task = descent.tasks[i];
      if (task.node)
        counters[thread]->update(task.node, task.created, blocks[i].marks, kBlockVoxels,
                                 blocks[i].block * kBlock, parts[begin / kChunk]);
    }
  });
  for (const auto& c : counters) tree_size += c->tree_size;  // wraps rightly when more was pruned than made
  size_changed = true;
  close(root, descent, 0, count, 0);
  return concatenated(std::move(parts));
}

}  // namespace fv
