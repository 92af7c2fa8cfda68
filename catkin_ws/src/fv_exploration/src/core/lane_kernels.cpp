#include "lane_kernels.h"

namespace fv {

namespace {

/// What one voxel adds, three counters in one number: a view counts fewer than 2^21 of each.
constexpr uint64_t kOneVoid = 1, kOneUnknown = uint64_t{1} << 21, kOneFrontier = uint64_t{1} << 42;
constexpr uint64_t kCountMask = kOneUnknown - 1;

struct GainTable {
  uint64_t adds[16];
  GainTable() {
    for (int flags = 0; flags < 16; ++flags) {
      adds[flags] = 0;
      if ((flags & Evaluator::kClassMask) == kUnknown) adds[flags] += kOneUnknown;
      if (flags & Evaluator::kVoidFlag) adds[flags] += kOneVoid;
      if (flags & Evaluator::kFrontierFlag) adds[flags] += kOneFrontier;
    }
  }
};
const GainTable kGainTable;

namespace plain {
#include "lane_kernels.inc"
}  // namespace plain

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512bw,avx512vl")
namespace wide {
#include "lane_kernels.inc"
}  // namespace wide
#pragma GCC pop_options

/// Has this processor the instructions of `wide`? Both round alike.
bool isWide() {
  static const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                           __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  return wide;
}
#else
namespace wide = plain;
bool isWide() { return false; }
#endif

}  // namespace

void markLanes(const MarkLanes& lanes, int steps, uint8_t* grid) {
  isWide() ? wide::markLanes(lanes, steps, grid) : plain::markLanes(lanes, steps, grid);
}

void castLanes(const LaneRays& rays, const GainGrid& grid, GainCounts& counts) {
  isWide() ? wide::castLanes(rays, grid, counts) : plain::castLanes(rays, grid, counts);
}

int64_t addLanes(const LaneRays& rays, const uint8_t* flags, const UtilitySums adds[kLanes],
                 UtilitySums* out) {
  return isWide() ? wide::addLanes(rays, flags, adds, out) : plain::addLanes(rays, flags, adds, out);
}

}  // namespace fv
