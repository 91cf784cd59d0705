// Records when datagrams pass the loopback interface, by the clock of the kernel, without a part in
// their sender or receiver.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <thread>

namespace fivepipe::wire {

struct Datagram {
  std::int64_t stamp_ns = 0;           // CLOCK_REALTIME in the kernel, during the sender's call
  std::uint16_t destination_port = 0;  // UDP
  std::span<const std::byte> payload;  // at most LoopbackTrace::kMaxPayloadBytes, then cut off
};

class LoopbackTrace {
 public:
  // Enough for the headers, the key and the frame number of each message.
  static constexpr std::size_t kMaxPayloadBytes = 1024;
  // Calls `each` for every UDP datagram over IPv4, in the order of sending, in its own thread.
  // Throws std::system_error; EPERM: the process lacks CAP_NET_RAW.
  explicit LoopbackTrace(std::function<void(const Datagram&)> each);
  ~LoopbackTrace();
  LoopbackTrace(const LoopbackTrace&) = delete;
  LoopbackTrace& operator=(const LoopbackTrace&) = delete;

  void stop();  // returns when the thread has handled everything sent before this call
  // Datagrams that the kernel dropped because the thread was too slow. Call after stop().
  std::uint64_t dropped() const { return dropped_; }

 private:
  void receive(const std::function<void(const Datagram&)>& each, const std::stop_token& stop);
  bool receive_one(const std::function<void(const Datagram&)>& each, int flags);
  int socket_;
  std::uint64_t dropped_ = 0;
  std::jthread thread_;
};

}  // namespace fivepipe::wire
