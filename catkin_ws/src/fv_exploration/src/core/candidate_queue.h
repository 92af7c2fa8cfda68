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

/// A node and how near its partner is.
struct Candidate {
  double squared_distance;
  int node;
};

/// Candidates, nearest first, ties by node. They wait in buckets of like distance and only the nearest bucket
/// is in order, so that a million of them do not wander through the caches.
class CandidateQueue {
 public:
  /// @param count about how many there will be. Few of them stay in the caches anyway: one heap for all.
  explicit CandidateQueue(std::size_t count) : front_(count < 512 ? INT_MAX - 1 : -1) {
    if (front_ < 0) chunks_.reserve(count / 4);  // to grow step by step would touch several times the memory
  }

  void push(const Candidate& c) {
    const int bucket = bucketOf(c.squared_distance);
    if (bucket > front_) return store(c, bucket);
    late_.push_back(c);
    std::push_heap(late_.begin(), late_.end(), later);
  }

  /// The nearest candidate; false when there is none left.
  bool pop(Candidate& out) {
    while (ordered_.empty() && late_.empty()) {
      if (++front_ >= static_cast<int>(buckets_.size())) return false;
      for (int c = buckets_[front_]; c != kNone; c = chunks_[c].next) {
        ordered_.insert(ordered_.end(), chunks_[c].candidates, chunks_[c].candidates + chunks_[c].size);
        unused_.push_back(c);
      }
      std::sort(ordered_.begin(), ordered_.end(), later);
    }
    if (!late_.empty() && (ordered_.empty() || later(ordered_.back(), late_.front()))) {
      std::pop_heap(late_.begin(), late_.end(), later);
      out = late_.back();
      late_.pop_back();
    } else {
      out = ordered_.back();
      ordered_.pop_back();
    }
    return true;
  }

  /// A candidate that is likely to be popped after `steps` others; nullptr when that is not known.
  const Candidate* ahead(std::size_t steps) const {
    return steps < ordered_.size() ? &ordered_[ordered_.size() - 1 - steps] : nullptr;
  }

 private:
  struct Later {
    bool operator()(const Candidate& p, const Candidate& q) const {
      return p.squared_distance != q.squared_distance ? p.squared_distance > q.squared_distance
                                                      : p.node > q.node;
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
  /// Some candidates of a bucket and where there are more; used again when the bucket has been opened.
  struct Chunk {
    int next, size;
    Candidate candidates[8];
  };

  void store(const Candidate& candidate, int bucket) {
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
    chunk.candidates[chunk.size++] = candidate;
  }

  std::vector<int> buckets_;  // first chunk of each
  BigVector<Chunk> chunks_;
  std::vector<int> unused_;
  int front_;                       // the bucket that is in order
  std::vector<Candidate> ordered_;  // of the bucket `front_`, nearest last
  std::vector<Candidate> late_;     // a heap of those that came later and belong no farther than `front_`
};

}  // namespace fv
