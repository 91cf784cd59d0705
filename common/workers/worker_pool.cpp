#include "common/workers/worker_pool.h"

#include <cassert>
#include <chrono>

namespace fivepipe {
namespace {

// How long a thread looks before it sleeps: what waking it would cost, several times over; a frame's phases follow each other
// faster than that.
constexpr std::chrono::microseconds kLooks{50};

inline void relax() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

template <class Done>
bool look(const Done& done) {
  const auto until = std::chrono::steady_clock::now() + kLooks;
  do {
    for (int i = 0; i < 64; ++i) {
      if (done()) return true;
      relax();
    }
  } while (std::chrono::steady_clock::now() < until);
  return false;
}

}  // namespace

WorkerPool::WorkerPool(int threads) {
  assert(threads > 0);
  for (int t = 1; t < threads; ++t) workers_.emplace_back([this, t] { serve(t); });
}

WorkerPool::~WorkerPool() {
  stop_ = true;
  run_.fetch_add(1);
  run_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::work_through(int thread) {
  for (int piece; (piece = next_piece_.fetch_add(1, std::memory_order_relaxed)) < pieces_;) call_(work_, piece, thread);
}

void WorkerPool::run_erased(int pieces, void* work, Call call) {
  if (pieces <= 0) return;
  work_ = work;
  call_ = call;
  pieces_ = pieces;
  next_piece_.store(0, std::memory_order_relaxed);
  if (!workers_.empty() && pieces > 1) {
    busy_.store(int(workers_.size()), std::memory_order_relaxed);
    run_.fetch_add(1);  // releases what stands above
    run_.notify_all();
  }
  work_through(0);
  for (int busy; (busy = busy_.load(std::memory_order_acquire)) != 0;)
    if (!look([&] { return busy_.load(std::memory_order_acquire) == 0; })) busy_.wait(busy);
}

void WorkerPool::serve(int thread) {
  for (std::uint32_t seen = 0;;) {
    if (!look([&] { return run_.load(std::memory_order_acquire) != seen; })) run_.wait(seen);
    seen = run_.load(std::memory_order_acquire);
    if (stop_) return;
    work_through(thread);
    if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_all();
  }
}

}  // namespace fivepipe
