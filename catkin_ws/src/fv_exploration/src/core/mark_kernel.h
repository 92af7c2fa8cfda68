#pragma once
#include <cstdint>
#include <vector>

#include "ray_walk.h"

namespace fv {

/// Rays that are walked eight at a time through a linear grid of marks.
class RayBatch {
 public:
  static constexpr int kCapacity = 1024;

  void clear() { size_ = 0; }
  bool full() const { return size_ == kCapacity; }
  /// @param at, end grid index of both ends; step: index difference along each axis.
  void add(const RayMaker::Ray& ray, int64_t at, int64_t end, const int64_t step[3]);
  /// Set every voxel of every ray to kMiss, with the roundings of computeRayKeys.
  void mark(uint8_t* grid);

 private:
  void sortByLength();

  int size_ = 0;
  double t_[3][kCapacity], delta_[3][kCapacity], length_[kCapacity];
  int64_t at_[kCapacity], end_[kCapacity], step_[3][kCapacity];
  int count_[kCapacity];  // steps that the ray takes, nearly
  std::vector<int> order_;
};

}  // namespace fv
