// Threads that share one piece of work after another with their caller: a frame's cameras, then its
// tiles.
#pragma once
#include <atomic>
#include <cstdint>
#include <thread>
#include <type_traits>
#include <vector>

namespace fivepipe::base {

// Kept for many runs: starting a thread takes longer than many a query. Between runs the threads
// look for work for a few microseconds, then sleep.
class WorkerPool {
 public:
  explicit WorkerPool(int threads);  // > 0; the caller counts as one of them
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  int threads() const { return int(workers_.size()) + 1; }

  // Calls work(piece, thread) once for each piece in [0, pieces), at most 16 million, thread in [0,
  // threads()), in ascending order of their start; returns when all are done. Pieces go to
  // whichever thread is free: results must not depend on `thread`. One run at a time; work must
  // neither throw nor call run.
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
  // The next piece and how many there are, in one word: who comes late finds nothing left, and need
  // not be waited for.
  struct Ticket {
    static constexpr int kIndexBits = 24;
    std::uint64_t word;
    int piece() const { return int(word & ((1u << kIndexBits) - 1)); }
    int pieces() const { return int(word >> kIndexBits & ((1u << kIndexBits) - 1)); }
  };
  alignas(64) std::atomic<std::uint64_t> ticket_ = 0;
  alignas(64) std::atomic<int> done_ = 0;           // pieces of the present run
  alignas(64) std::atomic<std::uint32_t> run_ = 0;  // counts runs; woken through it
  std::atomic<bool> stop_ = false;
};

}  // namespace fivepipe::base
