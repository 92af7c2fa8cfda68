#include "lane_kernels.h"

#include <cmath>

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
#pragma GCC target("avx2")
namespace avx2 {
#include "lane_kernels.inc"
}  // namespace avx2
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512bw,avx512vl")
namespace avx512 {
#include "lane_kernels.inc"
}  // namespace avx512
#pragma GCC pop_options
#endif

}  // namespace

std::vector<LaneKernels> laneKernels() {
  std::vector<LaneKernels> out;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl"))
    out.push_back({"AVX-512", avx512::markLanes, avx512::castLanes, avx512::addRays});
  if (__builtin_cpu_supports("avx2"))
    out.push_back({"AVX2", avx2::markLanes, avx2::castLanes, avx2::addRays});
#endif
  out.push_back({"baseline", plain::markLanes, plain::castLanes, plain::addRays});
  return out;
}

const LaneKernels& bestKernels() {
  static const LaneKernels best = laneKernels().front();
  return best;
}

}  // namespace fv
