// Decides when the virtual objects stand still because the simulation is missing. Pure.
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

namespace fivepipe::render {

class SimulationAge {
 public:
  // Longer than a restart of sim_node takes.
  static constexpr std::int64_t kMaxAge_ns = 500'000'000;
  // A state may be late by a frame.
  static constexpr double kMaxPeriods = 3;

  explicit SimulationAge(double frame_rate_hz)
      : max_age_ns_(std::max(kMaxAge_ns, std::int64_t(1e9 * kMaxPeriods / frame_rate_hz))) {}

  // Returns true if the state that a frame is composited with, or the first frame if no state has
  // arrived, is older than the frame by more than kMaxAge_ns and by more than
  // kMaxPeriods frames. Stamps: of the captures.
  bool is_missing(std::int64_t frame_stamp_ns, std::optional<std::int64_t> state_stamp_ns) {
    if (state_stamp_ns)
      newest_ns_ = std::max(newest_ns_.value_or(*state_stamp_ns), *state_stamp_ns);
    // A stamp after the frame was wrong, or capture began again.
    if (!newest_ns_ || *newest_ns_ > frame_stamp_ns) newest_ns_ = frame_stamp_ns;
    const bool is_too_old = frame_stamp_ns - *newest_ns_ > max_age_ns_;
    has_returned_ = std::exchange(was_missing_, is_too_old) && !is_too_old;
    return is_too_old;
  }
  // Whether it was missing before the newest is_missing(), and is not any more.
  bool has_returned() const { return has_returned_; }

 private:
  std::int64_t max_age_ns_;
  std::optional<std::int64_t> newest_ns_;  // newest state, or first frame
  bool was_missing_ = false, has_returned_ = false;
};

}  // namespace fivepipe::render
