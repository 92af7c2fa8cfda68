#include "fv_exploration/scan_marks.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <unordered_map>

#include "concatenate.h"
#include "mark_kernel.h"
#include "parallel.h"
#include "ray_walk.h"

namespace fv {

namespace {

constexpr int kRayChunk = 4096;

/// Offset of each mark of a block, in the order of octree children, in x + 8 y + 64 z.
struct ChildOrder {
  uint16_t linear[kBlockVoxels];
  ChildOrder() {
    for (int i = 0; i < kBlockVoxels; ++i) {
      int c[3] = {0, 0, 0};
      for (int level = 0; level < 3; ++level)
        for (int axis = 0; axis < 3; ++axis) c[axis] |= (i >> (3 * level + axis) & 1) << level;
      linear[i] = static_cast<uint16_t>(c[0] + 8 * c[1] + 64 * c[2]);
    }
  }
};
const ChildOrder kChildOrder;

/// All rays of a scan: hits first, then the cleared ones.
struct Ends {
  const ScanRays& rays;
  int size() const { return static_cast<int>(rays.hits.size() + rays.cleared.size()); }
  const octomap::point3d& operator[](int i) const {
    const int hits = static_cast<int>(rays.hits.size());
    return i < hits ? rays.hits[i] : rays.cleared[i - hits];
  }
};

/// Clear the marks of `linear` outside of `keep`, count the rest, and bring them into the order of octree
/// children.
bool takeBlock(const uint8_t* linear, const Voxel& block, const VoxelBox& keep, MarkBlock& out,
               MarkCounts& counts) {
  out.block = block;
  const Voxel low = block * kBlock;
  const bool inside = keep.contains(low) && keep.contains(low + Voxel::Constant(kBlock - 1));
  bool any = false;
  for (int i = 0; i < kBlockVoxels; ++i) {
    const int l = kChildOrder.linear[i];
    uint8_t mark = linear[l] & kHit ? uint8_t{kHit} : linear[l];  // a hit counts more than a miss
    if (mark && !inside && !keep.contains(low + Voxel(l & 7, l >> 3 & 7, l >> 6))) mark = kNoMark;
    out.marks[i] = mark;
    any |= mark != kNoMark;
    counts.free += mark == kMiss;
    counts.occupied += mark == kHit;
  }
  return any;
}

/// A dense byte grid around all rays for each thread: sharing one costs more than it saves.
class DenseMarks {
 public:
  DenseMarks(const Voxel& min, const Voxel& max, int threads) {
    for (int i = 0; i < 3; ++i) {
      origin_[i] = floorDiv(min[i], kBlock);
      blocks_[i] = floorDiv(max[i], kBlock) + 1 - origin_[i];
    }
    stride_ = {1, int64_t{blocks_.x()} * kBlock, int64_t{blocks_.x()} * blocks_.y() * kBlock * kBlock};
    for (int i = 0; i < threads; ++i) grids_.emplace_back(bytes(min, max));
  }
  static std::size_t bytes(const Voxel& min, const Voxel& max) {
    std::size_t size = kBlockVoxels;
    for (int i = 0; i < 3; ++i) size *= floorDiv(max[i], kBlock) + 1 - floorDiv(min[i], kBlock);
    return size;
  }

  void miss(const RayMaker::Ray& ray, RayBatch& batch, int thread) {
    const int64_t step[3] = {ray.step[0] * stride_[0], ray.step[1] * stride_[1], ray.step[2] * stride_[2]};
    batch.add(ray, index(ray.at), index(ray.end), step);
    if (batch.full()) batch.mark(grids_[thread].data());
  }
  void finish(RayBatch& batch, int thread) { batch.mark(grids_[thread].data()); }
  void hit(const Voxel& v) { grids_[0][index(v)] |= kHit; }

  std::vector<MarkBlock> blocks(const VoxelBox& keep, int threads, MarkCounts& counts) const {
    const int layers = blocks_.z();
    std::vector<std::vector<MarkBlock>> parts(layers);
    std::vector<MarkCounts> part_counts(layers);
    parallelChunks(layers, threads, 1, [&](int z, int, int) { layer(z, keep, parts[z], part_counts[z]); });
    for (const MarkCounts& part : part_counts) {
      counts.free += part.free;
      counts.occupied += part.occupied;
    }
    return concatenated(std::move(parts));
  }

 private:
  int64_t index(const Voxel& v) const {
    const Voxel d = v - origin_ * kBlock;
    return d.x() + d.y() * stride_[1] + d.z() * stride_[2];
  }

  void layer(int z, const VoxelBox& keep, std::vector<MarkBlock>& out, MarkCounts& counts) const {
    alignas(8) uint8_t linear[kBlockVoxels];
    MarkBlock taken;
    for (int y = 0; y < blocks_.y(); ++y)
      for (int x = 0; x < blocks_.x(); ++x) {
        const int64_t corner = kBlock * (x + y * stride_[1] + z * stride_[2]);
        uint64_t any = 0;
        for (int row = 0; row < 64; ++row) {
          const int64_t at = corner + (row & 7) * stride_[1] + (row >> 3) * stride_[2];
          uint64_t word = 0, some;
          for (const std::vector<uint8_t>& grid : grids_) {
            std::memcpy(&some, &grid[at], 8);
            word |= some;
          }
          std::memcpy(linear + 8 * row, &word, 8);
          any |= word;
        }
        if (any && takeBlock(linear, origin_ + Voxel(x, y, z), keep, taken, counts)) out.push_back(taken);
      }
  }

  Voxel origin_, blocks_;  // in blocks
  std::array<int64_t, 3> stride_;
  std::vector<std::vector<uint8_t>> grids_;
};

/// Blocks by their coordinates, for scans whose dense grid would be too large.
class SparseMarks {
 public:
  void miss(const RayMaker::Ray& ray) {
    Voxel at = ray.at;
    double t[3] = {ray.t_max[0], ray.t_max[1], ray.t_max[2]};
    while (true) {
      set(at, kMiss);
      const int dim = t[0] < t[1] ? (t[0] < t[2] ? 0 : 2) : (t[1] < t[2] ? 1 : 2);
      at[dim] += ray.step[dim];
      t[dim] += ray.t_delta[dim];
      if (at == ray.end || std::min(std::min(t[0], t[1]), t[2]) > ray.length) return;
    }
  }
  void set(const Voxel& v, uint8_t mark) {
    const Voxel block(floorDiv(v.x(), kBlock), floorDiv(v.y(), kBlock), floorDiv(v.z(), kBlock));
    if (!last_ || block != last_block_) {
      auto& found = blocks_[voxelId(block)];
      if (!found) found = std::make_unique<Block>(Block{block, {}});
      last_ = found.get();
      last_block_ = block;
    }
    const Voxel d = v - block * kBlock;
    uint8_t& value = last_->linear[d.x() + 8 * d.y() + 64 * d.z()];
    value = std::max(value, mark);
  }
  void absorb(const SparseMarks& other) {
    for (const auto& [id, theirs] : other.blocks_) {
      auto& found = blocks_[id];
      if (!found) found = std::make_unique<Block>(Block{theirs->block, {}});
      for (int i = 0; i < kBlockVoxels; ++i) found->linear[i] = std::max(found->linear[i], theirs->linear[i]);
    }
  }
  std::vector<MarkBlock> blocks(const VoxelBox& keep, MarkCounts& counts) const {
    std::vector<MarkBlock> all;
    MarkBlock taken;
    for (const auto& entry : blocks_)
      if (takeBlock(entry.second->linear, entry.second->block, keep, taken, counts)) all.push_back(taken);
    return all;
  }

 private:
  struct Block {
    Voxel block;
    uint8_t linear[kBlockVoxels];
  };
  std::unordered_map<uint64_t, std::unique_ptr<Block>> blocks_;
  Block* last_ = nullptr;
  Voxel last_block_{0, 0, 0};
};

/// The voxels that the rays span, with a margin for the last step's rounding; false without any.
/// Counts the ends beyond the keys.
bool extent(const Ends& ends, const RayMaker& maker, Voxel& min, Voxel& max, int64_t& outside) {
  if (!maker.voxel(ends.rays.origin, min)) return false;
  max = min;
  Voxel v;
  for (int i = 0; i < ends.size(); ++i) {
    if (maker.voxel(ends[i], v)) {
      min = min.cwiseMin(v);
      max = max.cwiseMax(v);
    } else {
      ++outside;
    }
  }
  min.array() -= 2;
  max.array() += 2;
  return true;
}

template <class Work>
void walkAll(const Ends& ends, const RayMaker& maker, int threads, const Work& miss) {
  parallelChunks(ends.size(), threads, kRayChunk, [&](int begin, int end, int thread) {
    RayMaker::Ray ray;
    for (int i = begin; i < end; ++i)
      if (maker.start(ends.rays.origin, ends[i], ray)) miss(ray, thread);
  });
}

std::vector<MarkBlock> markDense(const Ends& ends, const RayMaker& maker, const Voxel& min, const Voxel& max,
                                 const VoxelBox& keep, int threads, MarkCounts& counts) {
  DenseMarks marks(min, max, threads);
  std::vector<std::unique_ptr<RayBatch>> batches;
  for (int i = 0; i < threads; ++i) batches.push_back(std::make_unique<RayBatch>());
  walkAll(ends, maker, threads,
          [&](const RayMaker::Ray& ray, int thread) { marks.miss(ray, *batches[thread], thread); });
  for (int i = 0; i < threads; ++i) marks.finish(*batches[i], i);
  Voxel v;
  for (const octomap::point3d& hit : ends.rays.hits) {
    if (!maker.voxel(hit, v)) continue;
    marks.hit(v);
    ++counts.hits;
  }
  return marks.blocks(keep, threads, counts);
}

std::vector<MarkBlock> markSparse(const Ends& ends, const RayMaker& maker, const VoxelBox& keep, int threads,
                                  MarkCounts& counts) {
  std::vector<SparseMarks> marks(threads);
  walkAll(ends, maker, threads, [&](const RayMaker::Ray& ray, int thread) { marks[thread].miss(ray); });
  for (int i = 1; i < threads; ++i) marks[0].absorb(marks[i]);
  Voxel v;
  for (const octomap::point3d& hit : ends.rays.hits) {
    if (!maker.voxel(hit, v)) continue;
    marks[0].set(v, kHit);
    ++counts.hits;
  }
  return marks[0].blocks(keep, counts);
}

}  // namespace

std::vector<MarkBlock> markScan(const ScanRays& rays, double resolution_m, const VoxelBox& keep, int threads,
                                std::size_t dense_limit, MarkCounts& counts) {
  const Ends ends{rays};
  const RayMaker maker(resolution_m);
  counts.rays = ends.size();
  Voxel min, max;
  if (!extent(ends, maker, min, max, counts.outside)) {
    // As OctoMap: a sensor beyond the keys clears nothing, but its hits count.
    return markSparse(ends, maker, keep, threads, counts);
  }
  const std::size_t grids = dense_limit / DenseMarks::bytes(min, max);
  if (grids > 0)
    return markDense(ends, maker, min, max, keep, std::min<int>(threads, std::min<std::size_t>(grids, 256)),
                     counts);
  return markSparse(ends, maker, keep, threads, counts);
}

}  // namespace fv
