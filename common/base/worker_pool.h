// A thread pool for parallel loops: the pool's threads and the caller share the iterations.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace fivepipe::base {

// The threads live as long as the pool, because starting a thread takes longer than many queries.
// Between runs each thread polls for 50 us, then sleeps.
class WorkerPool {
 public:
  // `threads` > 0 includes the calling thread.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  int threads() const { return int(workers_.size()) + 1; }

  // Calls work(piece, thread) once for each piece in [0, pieces), pieces < 2^24, with thread in
  // [0, threads()). Pieces start in ascending order, each on the next free thread, so results must
  // not depend on `thread`. Returns when all pieces are done. Only one run() at a time; `work` must
  // neither throw nor call run().
  template <class Work>
  void run(int pieces, Work&& work) {
    run_type_erased(pieces, const_cast<void*>(static_cast<const void*>(&work)),
                    [](void* w, int piece, int thread) {
                      (*static_cast<std::remove_reference_t<Work>*>(w))(piece, thread);
                    });
  }

 private:
  using Call = void (*)(void* work, int piece, int thread);
  void run_type_erased(int pieces, void* work, Call call);
  void run_pieces(int thread);
  void worker_loop(int thread);

  std::vector<std::thread> workers_;
  void* work_ = nullptr;
  Call call_ = nullptr;
  // Holds the next index and the count in one atomic word, so a late worker finds no work and run()
  // need not wait for it.
  struct Ticket {
    static constexpr int kIndexBits = 24;
    std::uint64_t word;
    int piece() const { return int(word & ((1u << kIndexBits) - 1)); }
    int pieces() const { return int(word >> kIndexBits & ((1u << kIndexBits) - 1)); }
  };
  alignas(64) std::atomic<std::uint64_t> ticket_ = 0;
  alignas(64) std::atomic<int> done_ = 0;           // pieces of the current run
  alignas(64) std::atomic<std::uint32_t> run_ = 0;  // number of runs; the threads wait on it
  std::atomic<bool> stop_ = false;
};

// Calls work(i) for each i < count on the pool's threads; count < 2^24. `work` may throw: rethrows
// the first exception after all calls have returned.
template <class Work>
void in_parallel(WorkerPool& pool, std::size_t count, const Work& work) {
  std::mutex mutex;
  std::exception_ptr failure;
  pool.run(int(count), [&](int i, int) {
    try {
      work(std::size_t(i));
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  });
  if (failure) std::rethrow_exception(failure);
}

}  // namespace fivepipe::base
