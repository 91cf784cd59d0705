// Standard output for who must not wait for it: behind a pager that stands still, or a slow
// terminal.
#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

namespace fivepipe::base {

class OutputQueue {
 public:
  static constexpr std::size_t kMaxQueuedBytes = std::size_t(16) << 20;

  explicit OutputQueue(int file);
  ~OutputQueue();  // finishes
  OutputQueue(const OutputQueue&) = delete;
  OutputQueue& operator=(const OutputQueue&) = delete;

  // False: too much is waiting, and it was left out. Never waits.
  bool offer(std::string text);
  // Waits until there is room.
  void put(std::string text);
  // Nobody reads it any more, or it can't be written: what is put in from now on is gone.
  bool closed() const;
  // Writes what is waiting. The error number of what could not be written; 0: all was, or nobody
  // reads it any more.
  int finish();

 private:
  void write_until_closed();

  int file_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> queue_;
  std::size_t queued_bytes_ = 0;
  bool ending_ = false;
  std::atomic<bool> closed_{false};
  std::atomic<int> error_{0};
  std::thread thread_;
};

}  // namespace fivepipe::base
