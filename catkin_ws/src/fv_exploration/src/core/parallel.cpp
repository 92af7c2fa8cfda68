#include "parallel.h"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>

namespace fv {

namespace {

/// One call of parallelChunks: chunks are taken in order by whoever is free.
class Job {
 public:
  Job(int count, int chunk, const std::function<void(int, int, int)>& work)
      : count_(count), chunk_(chunk), chunks_((count + chunk - 1) / chunk), work_(work) {}

  int chunks() const { return chunks_; }
  void run(int thread) {
    try {
      for (int i = next_++; i < chunks_; i = next_++)
        work_(i * chunk_, std::min(count_, (i + 1) * chunk_), thread);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(error_mutex_);
      if (!error_) error_ = std::current_exception();
    }
  }
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }
  std::atomic<int> helping{0};  ///< threads of the pool at work on it

 private:
  int count_, chunk_, chunks_;
  const std::function<void(int, int, int)>& work_;
  std::atomic<int> next_{0};
  std::mutex error_mutex_;
  std::exception_ptr error_;
};

/// Wait a moment for something that is likely to come soon: to fall asleep and be woken takes longer.
template <class Condition>
bool soon(const Condition& condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::microseconds(50);
  do {
    if (condition()) return true;
    std::this_thread::yield();
  } while (std::chrono::steady_clock::now() < deadline);
  return condition();
}

/// Threads that stay and help. To start new ones for each of the short stages of an update would cost more
/// than they bring.
class Pool {
 public:
  /// The pool of this process; a forked one has none of its parent's threads and gets its own. Never
  /// destroyed: its threads may outlive static objects.
  static Pool& ofProcess() {
    static const int registered = pthread_atfork(nullptr, nullptr, [] { instance() = nullptr; });
    static_cast<void>(registered);
    if (Pool* pool = instance()) return *pool;
    Pool* none = nullptr;
    auto* fresh = new Pool;
    if (instance().compare_exchange_strong(none, fresh)) return *fresh;
    delete fresh;  // somebody else was faster; it has no threads yet
    return *none;
  }

  void run(Job& job, int helpers) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      for (int thread = 1; thread <= helpers; ++thread) tickets_.push_back({&job, thread});
      while (threads_ < static_cast<int>(tickets_.size()) + busy_ && startThread()) ++threads_;
      waiting_ += helpers;
    }
    helpers == 1 ? wake_.notify_one() : wake_.notify_all();
    job.run(0);
    finish(job);
  }

 private:
  struct Ticket {
    Job* job;
    int thread;
  };

  static std::atomic<Pool*>& instance() {
    static std::atomic<Pool*> pool{nullptr};
    return pool;
  }

  /// @return false when the system has no more: whoever is there does the work then, at least the caller.
  bool startThread() {
    try {
      std::thread([this] { help(); }).detach();
    } catch (const std::system_error&) {
      return false;
    }
    return true;
  }

  void help() {
    for (std::unique_lock<std::mutex> lock(mutex_);;) {
      if (tickets_.empty()) {
        lock.unlock();
        soon([this] { return waiting_ > 0; });
        lock.lock();
      }
      wake_.wait(lock, [this] { return !tickets_.empty(); });
      const Ticket ticket = tickets_.front();
      tickets_.pop_front();
      --waiting_;
      ++busy_;
      ++ticket.job->helping;
      lock.unlock();
      ticket.job->run(ticket.thread);
      lock.lock();
      --busy_;
      if (--ticket.job->helping == 0) done_.notify_all();
    }
  }

  /// Take back what nobody has begun, and wait for the others.
  void finish(Job& job) {
    std::unique_lock<std::mutex> lock(mutex_);
    const auto mine = [&](const Ticket& ticket) { return ticket.job == &job; };
    const auto rest = std::remove_if(tickets_.begin(), tickets_.end(), mine);
    waiting_ -= static_cast<int>(tickets_.end() - rest);
    tickets_.erase(rest, tickets_.end());
    if (job.helping == 0) return;
    lock.unlock();
    soon([&] { return job.helping == 0; });
    lock.lock();  // the last helper still holds it when it has gone
    done_.wait(lock, [&] { return job.helping == 0; });
  }

  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::deque<Ticket> tickets_;
  std::atomic<int> waiting_{0};  // as many as tickets_
  int threads_ = 0, busy_ = 0;
};

}  // namespace

int threadCount(int asked) {
  if (asked > 0) return asked;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallelChunks(int count, int threads, int chunk, const std::function<void(int, int, int)>& work) {
  Job job(count, chunk, work);
  const int helpers = std::min(threads, job.chunks()) - 1;
  if (helpers > 0)
    Pool::ofProcess().run(job, helpers);
  else
    job.run(0);
  job.rethrow();
}

}  // namespace fv
