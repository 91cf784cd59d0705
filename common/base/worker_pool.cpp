#include "common/base/worker_pool.h"

#include <cassert>
#include <chrono>

namespace fivepipe::base {
namespace {

// An idle thread polls for this time before it sleeps: several times the cost of waking it, and
// more than the pause between two phases of one frame.
constexpr std::chrono::microseconds kSpinTime{50};

inline void relax() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

template <class Done>
bool spin_until(const Done& done) {
  const auto until = std::chrono::steady_clock::now() + kSpinTime;
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
  for (int t = 1; t < threads; ++t) workers_.emplace_back([this, t] { worker_loop(t); });
}

WorkerPool::~WorkerPool() {
  stop_ = true;
  run_.fetch_add(1, std::memory_order_release);
  run_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::run_pieces(int thread) {
  for (;;) {
    // A plain increment past the last piece would overflow into the number of pieces.
    Ticket ticket{ticket_.load(std::memory_order_acquire)};
    do {
      if (ticket.piece() >= ticket.pieces()) return;
    } while (!ticket_.compare_exchange_weak(ticket.word, ticket.word + 1, std::memory_order_acq_rel,
                                            std::memory_order_acquire));
    call_(work_, ticket.piece(), thread);  // run(), and so work_, outlives this piece
    done_.fetch_add(1, std::memory_order_release);
  }
}

void WorkerPool::run_type_erased(int pieces, void* work, Call call) {
  assert(pieces < 1 << Ticket::kIndexBits);
  if (pieces <= 0) return;
  work_ = work;
  call_ = call;
  done_.store(0, std::memory_order_relaxed);
  // The run's number makes the ticket unique, so the compare-exchange of a thread that was
  // preempted during an earlier run fails.
  const std::uint64_t number = std::uint64_t(run_.load(std::memory_order_relaxed) & 0xffff)
                               << (2 * Ticket::kIndexBits);
  ticket_.store(number | std::uint64_t(pieces) << Ticket::kIndexBits, std::memory_order_release);
  run_.fetch_add(1, std::memory_order_release);
  if (!workers_.empty() && pieces > 1) run_.notify_all();
  run_pieces(0);
  while (!spin_until([&] { return done_.load(std::memory_order_acquire) == pieces; }))
    std::this_thread::yield();
}

void WorkerPool::worker_loop(int thread) {
  for (std::uint32_t seen = 0;;) {
    if (!spin_until([&] { return run_.load(std::memory_order_acquire) != seen; })) run_.wait(seen);
    seen = run_.load(std::memory_order_acquire);
    if (stop_) return;
    run_pieces(thread);
  }
}

}  // namespace fivepipe::base
