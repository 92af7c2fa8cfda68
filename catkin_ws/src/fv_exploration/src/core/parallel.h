#pragma once
#include <functional>

namespace fv {

/// Number of threads to use when `asked` are asked for; 0 means all cores.
int threadCount(int asked);

/// Call work(begin, end, thread) for contiguous chunks of [0, count) on up to `threads` threads.
/// Chunks are handed out in order; the result of the work must not depend on who does it.
void parallelChunks(int count, int threads, int chunk, const std::function<void(int, int, int)>& work);

}  // namespace fv
