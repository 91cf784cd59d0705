// Compares the clocks of two hosts by the times of messages, as NTP does (RFC 5905, section 8).
// Pure.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

namespace fivepipe::launch {

struct ClockOffset {
  std::int64_t offset_ns = 0;  // their clock minus the own one
  std::int64_t error_ns = 0;   // upper bound of |true offset - offset_ns|
};

// The times of a message to the other host and of a later one back, each by the clock of the host
// that it is named after.
struct ClockExchange {
  std::int64_t own_sent_ns = 0, their_received_ns = 0;
  std::int64_t their_sent_ns = 0, own_received_ns = 0;
};

class ClockComparison {
 public:
  // The best of this many exchanges counts.
  static constexpr std::size_t kExchanges = 16;
  // The quartz of a computer is wrong by at most 50 ppm, so that two clocks drift apart by at most
  // this much while nothing corrects them. A daemon that corrects a clock may change it faster.
  static constexpr double kMaxDrift = 1e-4;

  // Ignores an exchange whose times are impossible. An exchange that contradicts the earlier ones
  // replaces them: somebody has set a clock.
  void add(const ClockExchange& exchange);
  // Returns the offset of the exchange with the smallest error; nullopt before the first exchange.
  // now_ns: by the own clock.
  std::optional<ClockOffset> offset(std::int64_t now_ns) const;

 private:
  struct Measured {
    ClockOffset offset;  // at own_ns
    std::int64_t own_ns = 0;
  };
  static ClockOffset at(const Measured& measured, std::int64_t now_ns);
  std::deque<Measured> newest_;
};

// The hosts' clocks should differ by less than kClockWarning_ns; a deployment does not start if
// they differ by more than kClockLimit_ns.
enum class ClockVerdict { good, warning, refused };
inline constexpr std::int64_t kClockWarning_ns = 2'000'000, kClockLimit_ns = 20'000'000;
// Judges what the offset is at least, whatever its error.
ClockVerdict verdict_on(const ClockOffset& offset);

// "150.00 ms ahead (error at most 0.12 ms)".
std::string text_of(const ClockOffset& offset);

}  // namespace fivepipe::launch
