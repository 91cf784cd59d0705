// Bounds the lines that a node logs about messages.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

namespace fivepipe::node {

// Grants at most kMaxLines lines per kPeriod. Other processes cause these lines, and `fivepipe up`
// prints them. Not thread-safe.
class LogBudget {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kMaxLines = 10;
  static constexpr std::chrono::seconds kPeriod{5};

  // Returns whether a line may be logged at `now`. Counts it as suppressed otherwise.
  bool take(Clock::time_point now) {
    if (!started_ || now - *started_ >= kPeriod) {
      started_ = now;
      used_ = 0;
    }
    const bool granted = used_ < kMaxLines;
    if (granted)
      ++used_;
    else
      ++suppressed_;
    return granted;
  }
  // Returns the number of suppressed lines since it last returned one, at most once per kPeriod;
  // otherwise 0.
  std::uint64_t take_suppressed(Clock::time_point now) {
    if (suppressed_ == 0 || (reported_ && now - *reported_ < kPeriod)) return 0;
    reported_ = now;
    return std::exchange(suppressed_, 0);
  }

 private:
  std::optional<Clock::time_point> started_, reported_;
  int used_ = 0;
  std::uint64_t suppressed_ = 0;
};

}  // namespace fivepipe::node
