#include "lane_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "fv_exploration/errors.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace fv {

namespace {

template <int width>
struct Vectors {
  typedef double Doubles __attribute__((vector_size(8 * width)));
  typedef int64_t Integers __attribute__((vector_size(8 * width)));
};

/// How many bits are set; not every machine counts them in one instruction.
struct BitCounts {
  uint8_t of[1 << kLanes];
  BitCounts() {
    for (int bits = 0; bits < 1 << kLanes; ++bits) of[bits] = static_cast<uint8_t>(__builtin_popcount(bits));
  }
};
const BitCounts kBitCounts;

// For each instruction set the width of its vectors, in numbers of 8 bytes, and what it has for
//   below, same   all bits of the numbers for which it is true, none of others
//   negative      the same, of one vector
//   least         the lesser of each two
//   signs         the signs of all numbers as bits.
// Not a < b of vectors: from that GCC makes choices between two vectors, which SSE2 has not, and takes them
// apart.

#if defined(__x86_64__)
namespace sse2 {
constexpr int kWidth = 2;
using Doubles = Vectors<kWidth>::Doubles;
using Integers = Vectors<kWidth>::Integers;
inline Integers below(Doubles a, Doubles b) { return (Integers)_mm_cmplt_pd(a, b); }
inline Integers same(Integers a, Integers b) {  // it compares no more than 32 bits
  const __m128i halves = _mm_cmpeq_epi32((__m128i)a, (__m128i)b);
  return (Integers)_mm_and_si128(halves, _mm_shuffle_epi32(halves, 0xb1));
}
inline Integers negative(Integers a) {
  return (Integers)_mm_shuffle_epi32(_mm_srai_epi32((__m128i)a, 31), 0xf5);
}
inline Doubles least(Doubles a, Doubles b) { return _mm_min_pd(a, b); }
inline unsigned signs(Integers a) { return _mm_movemask_pd((__m128d)a); }
#include "lane_kernels.inc"
}  // namespace sse2

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif
namespace avx2 {
constexpr int kWidth = 4;
using Doubles = Vectors<kWidth>::Doubles;
using Integers = Vectors<kWidth>::Integers;
inline Integers below(Doubles a, Doubles b) { return (Integers)_mm256_cmp_pd(a, b, _CMP_LT_OQ); }
inline Integers same(Integers a, Integers b) { return (Integers)_mm256_cmpeq_epi64((__m256i)a, (__m256i)b); }
inline Integers negative(Integers a) {
  return (Integers)_mm256_cmpgt_epi64(_mm256_setzero_si256(), (__m256i)a);
}
inline Doubles least(Doubles a, Doubles b) { return _mm256_min_pd(a, b); }
inline unsigned signs(Integers a) { return _mm256_movemask_pd((__m256d)a); }
#include "lane_kernels.inc"
}  // namespace avx2
#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512bw,avx512vl"))), \
                             apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512bw,avx512vl")
#endif
namespace avx512 {
constexpr int kWidth = 8;
using Doubles = Vectors<kWidth>::Doubles;
using Integers = Vectors<kWidth>::Integers;
inline Integers below(Doubles a, Doubles b) { return a < b; }  // these choices it has
inline Integers same(Integers a, Integers b) { return a == b; }
inline Integers negative(Integers a) { return a >> 63; }
inline Doubles least(Doubles a, Doubles b) { return a < b ? a : b; }
inline unsigned signs(Integers a) { return _mm512_movepi64_mask((__m512i)a); }
#include "lane_kernels.inc"
}  // namespace avx512
#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif

#if defined(__aarch64__)
namespace neon {
constexpr int kWidth = 2;
using Doubles = Vectors<kWidth>::Doubles;
using Integers = Vectors<kWidth>::Integers;
inline Integers below(Doubles a, Doubles b) { return a < b; }
inline Integers same(Integers a, Integers b) { return a == b; }
inline Integers negative(Integers a) { return a < 0; }
inline Doubles least(Doubles a, Doubles b) { return a < b ? a : b; }
inline unsigned signs(Integers a) {
  return static_cast<unsigned>((static_cast<uint64_t>(a[0]) >> 63) |
                               (static_cast<uint64_t>(a[1]) >> 63 << 1));
}
#include "lane_kernels.inc"
}  // namespace neon
#endif

/// Kernels that were compiled, and whether this processor can run them.
struct Compiled {
  LaneKernels kernels;
  bool runs;
};

/// The best first.
std::vector<Compiled> compiledKernels() {
  std::vector<Compiled> out;
#if defined(__x86_64__)
  const bool runs_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                           __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  out.push_back({{"avx512", avx512::markLanes, avx512::castLanes, avx512::addRays}, runs_avx512});
  out.push_back(
      {{"avx2", avx2::markLanes, avx2::castLanes, avx2::addRays}, bool(__builtin_cpu_supports("avx2"))});
  out.push_back({{"sse2", sse2::markLanes, sse2::castLanes, sse2::addRays}, true});
#elif defined(__aarch64__)
  out.push_back({{"neon", neon::markLanes, neon::castLanes, neon::addRays}, true});
#endif
  out.push_back({plainKernels(), true});
  return out;
}

}  // namespace

std::vector<LaneKernels> laneKernels() {
  std::vector<LaneKernels> out;
  for (const Compiled& compiled : compiledKernels())
    if (compiled.runs) out.push_back(compiled.kernels);
  return out;
}

LaneKernels cappedKernels(const std::string& cap) {
  bool allowed = cap.empty();
  std::string valid;
  for (const Compiled& compiled : compiledKernels()) {
    allowed = allowed || cap == compiled.kernels.instruction_set;
    if (allowed && compiled.runs) return compiled.kernels;
    valid += std::string(valid.empty() ? "" : ", ") + compiled.kernels.instruction_set;
  }
  throw InputError("FV_INSTRUCTION_SET is '" + cap + "'; valid: " + valid + ", or unset for the best");
}

const LaneKernels& bestKernels() {
  static const LaneKernels best = [] {
    const char* cap = std::getenv("FV_INSTRUCTION_SET");
    return cappedKernels(cap ? cap : "");
  }();
  return best;
}

}  // namespace fv
