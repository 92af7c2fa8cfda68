#include "fv_exploration/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace fv {

int threadCount(int asked) {
  if (asked > 0) return asked;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallelChunks(int count, int threads, int chunk, const std::function<void(int, int, int)>& work) {
  const int chunks = (count + chunk - 1) / chunk;
  const int workers = std::min(threads, chunks);
  std::atomic<int> next{0};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto loop = [&](int thread) {
    try {
      for (int i = next++; i < chunks; i = next++) work(i * chunk, std::min(count, (i + 1) * chunk), thread);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(error_mutex);
      if (!error) error = std::current_exception();
    }
  };
  std::vector<std::thread> pool;
  for (int thread = 1; thread < workers; ++thread) pool.emplace_back(loop, thread);
  loop(0);
  for (std::thread& thread : pool) thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace fv
