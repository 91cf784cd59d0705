// When the next frame is captured: by the clock of the frame rate, and never more than a few frames
// ahead of what has been composited.
//
// Every node downstream sees the same choice of frames, because it is made here: were each to drop
// what it can't keep up with, the tiles of different nodes would be of different frames and few
// views would become complete.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

namespace fivepipe::capture {

class Pacing {
 public:
  using Clock = std::chrono::steady_clock;

  // max_in_flight 0: by the clock alone.
  Pacing(double frame_rate_hz, int max_in_flight, Clock::time_point start);

  // The frame to capture at `now`, or nothing while its time has not come or too many are in
  // flight. Frames whose time passes meanwhile are skipped and counted; a frame is never named
  // twice. Where nobody is there that composites, the clock alone decides. Where somebody is, but
  // nothing has come of the frames in flight for kStallTimeout, they are given up: a node on their
  // way was lost.
  std::optional<std::int64_t> next(Clock::time_point now, bool has_renderer);
  // When to ask again: the next frame's time, or soon where frames in flight hold it up.
  Clock::time_point next_wakeup(Clock::time_point now) const;

  void composited(std::uint64_t frame, Clock::time_point now);
  // Since the last call: frames whose time passed while too many were in flight, or while this node
  // was busy.
  std::uint64_t take_skipped();

  static constexpr std::chrono::milliseconds kStallTimeout{500};

 private:
  std::int64_t frame_at(Clock::time_point now) const;
  Clock::time_point time_of(std::int64_t frame) const;
  int in_flight() const;

  double frame_rate_hz_;
  int max_in_flight_;
  Clock::time_point start_;
  Clock::time_point last_progress_;  // of a composited frame, or gave those in flight up
  std::int64_t last_ = -1;
  std::int64_t composited_ = -1;
  std::int64_t issued_[64] = {};  // ring of the newest frames named, by count
  std::uint64_t issued_count_ = 0, skipped_ = 0;
};

}  // namespace fivepipe::capture
