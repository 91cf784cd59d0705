// How a process shows its supervisor on the same machine that it runs: two counters in memory that
// both share. It needs no network, and a stopped process writes nothing.
#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace fivepipe::base {

// The supervisor starts the process with the file descriptor of the memory in this variable.
inline constexpr const char* kHeartbeatVariable = "FIVEPIPE_HEARTBEAT";

struct Beats {
  // Ten per second, from a thread of its own. kEnding: the process is about to end and beats no
  // more. 0: it has not begun.
  std::atomic<std::uint64_t> process;
  std::atomic<std::uint64_t> loop;  // one per node::running(), which the main loop calls
  static constexpr std::uint64_t kEnding = UINT64_MAX;
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free, "shared between processes");

// The supervisor's memory for one process.
class Heartbeat {
 public:
  Heartbeat();  // throws std::system_error
  ~Heartbeat();
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;

  int file() const { return file_; }  // for the process; closed on exec
  std::uint64_t process() const { return beats_->process.load(std::memory_order_relaxed); }
  std::uint64_t loop() const { return beats_->loop.load(std::memory_order_relaxed); }

 private:
  int file_ = -1;
  Beats* beats_ = nullptr;
};

// The process's side. No effect without a supervisor.

// Beats ten times per second from its construction; the destructor ends the beats. Its thread does
// nothing else, so that no lock and no full network delays it.
class BeatingThread {
 public:
  BeatingThread();
  ~BeatingThread();
  BeatingThread(const BeatingThread&) = delete;
  BeatingThread& operator=(const BeatingThread&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::thread thread_;
};

void beat_loop();  // thread-safe

}  // namespace fivepipe::base
