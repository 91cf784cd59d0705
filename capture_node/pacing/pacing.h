// Selects the frame to capture next: by the clock of the frame rate, and at most max_in_flight
// frames ahead of the newest composited frame.
//
// The capture node drops frames for all nodes downstream. If each node dropped frames by itself,
// the tiles of different nodes would belong to different frames, and few views would be complete.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

namespace fivepipe::capture {

class Pacing {
 public:
  using Clock = std::chrono::steady_clock;

  // max_in_flight 0: the clock alone decides.
  Pacing(double frame_rate_hz, int max_in_flight, Clock::time_point start);

  // Returns the frame to capture at `now`, or nullopt before the next frame's time, and while
  // max_in_flight frames are in flight. Frames whose time passes meanwhile are skipped and counted;
  // no frame is returned twice. Without a renderer, the clock alone decides. With a renderer, if no
  // frame in flight has been composited for stall_timeout(), next() drops all frames in flight,
  // because a node downstream was lost.
  std::optional<std::int64_t> next(Clock::time_point now, bool has_renderer);
  // Returns the next frame's time, or `now` if that time has passed while frames in flight hold it
  // back.
  Clock::time_point next_wakeup(Clock::time_point now) const;

  // Reports that `frame` has been composited.
  void composited(std::uint64_t frame, Clock::time_point now);
  // Reports that neither `frame` nor an earlier one will be composited.
  void give_up(std::uint64_t frame, Clock::time_point now);
  void give_up_all(Clock::time_point now) { give_up(UINT64_MAX >> 1, now); }
  // Returns the number of frames skipped since the last call, because too many were in flight or
  // this node was busy.
  std::uint64_t take_skipped();

  // Time without a composited frame after which the frames in flight count as lost:
  // kStallPeriods times the mean time between the newest composited frames, within kMinStallTimeout
  // and kStallTimeout; the latter before there are two.
  Clock::duration stall_timeout() const;
  static constexpr int kStallPeriods = 4;
  static constexpr std::chrono::milliseconds kMinStallTimeout{150}, kStallTimeout{500};

 private:
  std::int64_t frame_at(Clock::time_point now) const;
  Clock::time_point time_of(std::int64_t frame) const;
  int in_flight() const;

  double frame_rate_hz_;
  int max_in_flight_;
  Clock::time_point start_;
  Clock::time_point last_progress_;  // last composited frame, or last drop of frames in flight
  std::int64_t last_ = -1;           // newest frame that next() returned
  std::int64_t composited_ = -1;     // newest composited frame
  std::deque<Clock::time_point> composited_at_;  // of the newest frames
  std::int64_t issued_[64] = {};  // ring buffer of the newest frames that next() returned
  std::uint64_t issued_count_ = 0, skipped_ = 0;
};

}  // namespace fivepipe::capture
