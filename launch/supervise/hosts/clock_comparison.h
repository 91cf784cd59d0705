// Compares the clocks of two hosts by the times of messages, as NTP does (RFC 5905, section 8). Pure.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace fivepipe::launch {

// |true offset - offset_ns| <= error_ns, if neither clock was set in between.
struct ClockOffset {
  std::int64_t offset_ns = 0;  // their clock minus the own one
  std::int64_t error_ns = 0;   // half of the time that both messages were on their way
};

// The times of a message to the other host and of a later one back, each by the clock of the host
// that it is named after.
struct ClockExchange {
  std::int64_t own_sent_ns = 0, their_received_ns = 0;
  std::int64_t their_sent_ns = 0, own_received_ns = 0;
};

class ClockComparison {
 public:
  // The best of this many exchanges counts. Clocks drift apart by some 0.1 ms in this time, at two
  // exchanges per second.
  static constexpr std::size_t kExchanges = 16;

  // Ignores an exchange whose times are impossible.
  void add(const ClockExchange& exchange);
  // Returns the offset of the exchange with the smallest error; nullopt before the first one.
  std::optional<ClockOffset> offset() const;

 private:
  std::deque<ClockOffset> newest_;
};

}  // namespace fivepipe::launch
