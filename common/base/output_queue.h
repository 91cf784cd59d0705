// Writes text to a file descriptor in its own thread, so that a stalled pager or a slow terminal
// does not stall the caller.
#pragma once
#include <atomic>
#include <cstddef>
#include <string>
#include <thread>

#include "common/base/bounded_queue.h"

namespace fivepipe::base {

// Whether the file is a pipe or a socket whose reader has closed its end.
bool is_broken_pipe(int file);

class OutputQueue {
 public:
  static constexpr std::size_t kMaxQueuedBytes = std::size_t(16) << 20;

  // Borrows the file descriptor. Ignores SIGPIPE in the whole process.
  explicit OutputQueue(int file);
  ~OutputQueue();  // calls finish()
  OutputQueue(const OutputQueue&) = delete;
  OutputQueue& operator=(const OutputQueue&) = delete;

  // Never waits. Returns false, and drops the text, if kMaxQueuedBytes are queued.
  bool offer(std::string text);
  // Waits until less than kMaxQueuedBytes are queued.
  void put(std::string text);
  // Returns true if the reader has closed its end or a write has failed. The queue then drops
  // everything that is put into it.
  bool closed() const;
  // Writes the queued text and stops the thread. Returns the errno of a failed write, or 0; a
  // reader that closed its end (EPIPE) is no failure.
  int finish();

 private:
  void write_until_closed();

  int file_;
  BoundedQueue<std::string> queue_{kMaxQueuedBytes};  // its cost is in bytes
  std::atomic<bool> closed_{false};
  std::atomic<int> error_{0};
  std::thread thread_;
};

}  // namespace fivepipe::base
