// Selects the frame to capture next without a clock: every frame, one after the other, as soon as
// fewer than max_in_flight frames are published and not yet composited. For offline work.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

namespace fivepipe::capture {

class FrameByFrame {
 public:
  using Clock = std::chrono::steady_clock;

  // max_in_flight > 0.
  FrameByFrame(int max_in_flight, Clock::time_point start)
      : max_in_flight_(max_in_flight), last_progress_(start) {}

  // Returns the next frame, or nullopt while max_in_flight frames are in flight. If none of them
  // has been composited for kLostTimeout, counts them as lost.
  std::optional<std::int64_t> next(Clock::time_point now) {
    give_up_lost(now);
    if (in_flight() >= max_in_flight_) return std::nullopt;
    if (in_flight() == 0) last_progress_ = now;
    return ++last_;
  }
  // Returns true after all frames have been composited or lost.
  bool is_done(Clock::time_point now) {
    give_up_lost(now);
    return in_flight() == 0;
  }

  // The newest frame that next() returned is not published.
  void withdraw() { --last_; }
  // Reports that `frame` has been composited: no earlier frame follows.
  void composited(std::uint64_t frame, Clock::time_point now) {
    const auto number = std::int64_t(frame);
    if (number > last_ || number <= composited_) return;
    lost_ += std::uint64_t(number - composited_ - 1);
    composited_ = number;
    last_progress_ = now;
  }
  // Returns the number of frames since the last call that were published and not composited.
  std::uint64_t take_lost() { return std::exchange(lost_, 0); }

  // Longer than the time of a frame in any scene, and than the restart of a node.
  static constexpr std::chrono::seconds kLostTimeout{20};

 private:
  std::int64_t in_flight() const { return last_ - composited_; }
  void give_up_lost(Clock::time_point now) {
    if (in_flight() == 0 || now - last_progress_ < kLostTimeout) return;
    lost_ += std::uint64_t(in_flight());
    composited_ = last_;
    last_progress_ = now;
  }

  std::int64_t max_in_flight_;
  Clock::time_point last_progress_;
  std::int64_t last_ = -1;        // newest frame that next() returned
  std::int64_t composited_ = -1;  // newest frame that is composited or lost
  std::uint64_t lost_ = 0;
};

}  // namespace fivepipe::capture
