// Writes text to a file descriptor in its own thread, so that a stalled pager, a slow terminal or a
// hung disk does not stall the caller.
#pragma once
#include <chrono>
#include <cstddef>
#include <future>
#include <memory>
#include <string>
#include <thread>

namespace fivepipe::base {

// Whether the file is a pipe or a socket whose reader has closed its end.
bool is_broken_pipe(int file);

class OutputQueue {
 public:
  static constexpr std::size_t kMaxQueuedBytes = std::size_t(16) << 20;

  // Duplicates the file descriptor, and throws std::system_error if it cannot. Ignores SIGPIPE in
  // the whole process.
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
  // As finish(), but waits at most `timeout`. Then drops the queued text and returns ETIMEDOUT. The
  // thread ends when its write() returns, and then closes its file descriptor.
  int finish(std::chrono::nanoseconds timeout);

 private:
  struct State;
  std::shared_ptr<State> state_;  // shared with the thread, which may outlive this object
  std::future<void> ended_;       // of the thread
  std::thread thread_;
};

}  // namespace fivepipe::base
