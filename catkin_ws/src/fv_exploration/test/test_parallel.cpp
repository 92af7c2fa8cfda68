// The pool of threads: every chunk once, errors told, calls within calls and beside each other, and after a
// fork.
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

#include "parallel.h"

namespace {

int sumOfChunks(int count, int threads, int chunk) {
  std::atomic<int> sum{0};
  fv::parallelChunks(count, threads, chunk, [&](int begin, int end, int) {
    for (int i = begin; i < end; ++i) sum += i;
  });
  return sum;
}

TEST(Parallel, EveryChunkIsDoneOnce) {
  for (const int count : {0, 1, 7, 1000})
    for (const int threads : {1, 2, 5})
      for (const int chunk : {1, 3, 2000}) {
        std::vector<std::atomic<int>> times(count);
        fv::parallelChunks(count, threads, chunk, [&](int begin, int end, int thread) {
          EXPECT_TRUE(thread >= 0 && thread < threads);
          for (int i = begin; i < end; ++i) ++times[i];
        });
        for (const std::atomic<int>& time : times) EXPECT_EQ(time, 1);
      }
}

TEST(Parallel, AnErrorReachesTheCallerAndTheNextCallWorks) {
  const auto fail = [](int begin, int, int) {
    if (begin == 5) throw std::runtime_error("five");
  };
  EXPECT_THROW(fv::parallelChunks(100, 3, 1, fail), std::runtime_error);
  EXPECT_EQ(sumOfChunks(100, 3, 1), 4950);
}

TEST(Parallel, CallsWithinCallsAndBesideEachOther) {
  std::vector<std::thread> callers;
  std::atomic<int> wrong{0};
  for (int caller = 0; caller < 4; ++caller)
    callers.emplace_back([&] {
      for (int round = 0; round < 200; ++round) {
        std::atomic<int> sum{0};
        fv::parallelChunks(4, 2, 1, [&](int, int, int) { sum += sumOfChunks(50, 2, 4); });
        wrong += sum != 4 * 1225;
      }
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(wrong, 0);
}

TEST(Parallel, AForkedProcessHasItsOwnThreads) {
  EXPECT_EQ(sumOfChunks(100, 2, 1), 4950);
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);  // hanging is what it would do
    _exit(sumOfChunks(100, 2, 1) == 4950 ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(Parallel, WithoutMoreThreadsTheCallerDoesTheWork) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);
    pthread_attr_t greedy;  // stacks that no address space holds: as a limit of threads that is reached
    pthread_attr_init(&greedy);
    pthread_attr_setstacksize(&greedy, std::size_t{1} << 47);
    if (pthread_setattr_default_np(&greedy) != 0) _exit(2);
    try {
      std::thread([] {}).join();
      _exit(3);
    } catch (const std::system_error&) {
      _exit(sumOfChunks(100, 5, 1) == 4950 && sumOfChunks(100, 3, 2) == 4950 ? 0 : 1);
    }
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

}  // namespace
