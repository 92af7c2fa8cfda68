#pragma once
#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <vector>

#include "big_vector.h"

namespace fv {

/// Two nodes that may merge; `low` < `high`.
struct Pair {
  double squared_distance;
  int32_t low, high;
  int64_t count;  ///< voxels of both: tells whether one of them has grown since
};

/// Pairs, nearest first, ties by the lower, then the higher node. They wait in buckets of like distance and
/// only the nearest bucket is in order, so that a million pairs do not wander through the caches.
class PairQueue {
 public:
  /// @param pairs about how many there will be. Few of them stay in the caches anyway: one heap for all.
  explicit PairQueue(std::size_t pairs) : front_(pairs < 2048 ? INT_MAX - 1 : -1) {
    if (front_ < 0) chunks_.reserve(pairs / 6);  // to grow step by step would touch several times the memory
  }

  void push(const Pair& pair) {
    const int bucket = bucketOf(pair.squared_distance);
    if (bucket > front_) return store(pair, bucket);
    late_.push_back(pair);
    std::push_heap(late_.begin(), late_.end(), later);
  }

  /// The nearest pair; false when there is none left.
  /// @param current tells whether a pair still stands for its nodes; others may be dropped without being
  /// returned.
  template <class Current>
  bool pop(const Current& current, Pair& pair) {
    while (ordered_.empty() && late_.empty()) {
      if (++front_ >= static_cast<int>(buckets_.size())) return false;
      for (int c = buckets_[front_]; c != kNone;) {
        const Chunk& chunk = chunks_[c];
        std::copy_if(chunk.pairs, chunk.pairs + chunk.size, std::back_inserter(ordered_), current);
        unused_.push_back(c);
        c = chunk.next;
      }
      std::sort(ordered_.begin(), ordered_.end(), later);
    }
    if (!late_.empty() && (ordered_.empty() || later(ordered_.back(), late_.front()))) {
      std::pop_heap(late_.begin(), late_.end(), later);
      pair = late_.back();
      late_.pop_back();
    } else {
      pair = ordered_.back();
      ordered_.pop_back();
    }
    return true;
  }

  /// A pair that is likely to be popped after `steps` others; nullptr when that is not known.
  const Pair* ahead(std::size_t steps) const {
    return steps < ordered_.size() ? &ordered_[ordered_.size() - 1 - steps] : nullptr;
  }

 private:
  struct Later {
    bool operator()(const Pair& p, const Pair& q) const {
      if (p.squared_distance != q.squared_distance) return p.squared_distance > q.squared_distance;
      return p.low != q.low ? p.low > q.low : p.high > q.high;
    }
  };
  static constexpr Later later{};

  /// 64 buckets for each doubling of the squared distance, which is the order of the bits of a positive
  /// double.
  static int bucketOf(double squared_distance) {
    constexpr double kNearest = 1.0 / 16, kFarthest = 1099511627776.0;  // voxels^2
    uint64_t bits, first;
    const double value = std::clamp(squared_distance, kNearest, kFarthest);
    std::memcpy(&bits, &value, 8);
    std::memcpy(&first, &kNearest, 8);
    return static_cast<int>((bits - first) >> 46);
  }

  static constexpr int kNone = -1;
  /// Some pairs of a bucket and where there are more; used again when the bucket has been opened.
  struct Chunk {
    int next, size;
    Pair pairs[8];
  };

  void store(const Pair& pair, int bucket) {
    if (bucket >= static_cast<int>(buckets_.size())) buckets_.resize(bucket + 1, kNone);
    int& first = buckets_[bucket];
    if (first == kNone || chunks_[first].size == 8) {
      int fresh = static_cast<int>(chunks_.size());
      if (unused_.empty()) {
        chunks_.emplace_back();
      } else {
        fresh = unused_.back();
        unused_.pop_back();
      }
      chunks_[fresh].next = first;
      chunks_[fresh].size = 0;
      first = fresh;
    }
    Chunk& chunk = chunks_[first];
    chunk.pairs[chunk.size++] = pair;
  }

  std::vector<int> buckets_;  // first chunk of each
  BigVector<Chunk> chunks_;
  std::vector<int> unused_;
  int front_;                  // the bucket that is in order
  std::vector<Pair> ordered_;  // of the bucket `front_`, nearest last
  std::vector<Pair> late_;     // a heap of those that came later and belong no farther than `front_`
};

}  // namespace fv
