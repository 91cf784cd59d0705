#include "capture_node/pacing/pacing.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace fivepipe::capture {
namespace {

constexpr std::size_t kIntervals = 8;  // whose mean counts

}  // namespace

Pacing::Pacing(double frame_rate_hz, int max_in_flight, Clock::time_point start)
    : frame_rate_hz_(frame_rate_hz),
      max_in_flight_(max_in_flight),
      start_(start),
      last_progress_(start) {}

std::int64_t Pacing::frame_at(Clock::time_point now) const {
  return std::int64_t(
      std::floor(std::chrono::duration<double>(now - start_).count() * frame_rate_hz_));
}

Pacing::Clock::time_point Pacing::time_of(std::int64_t frame) const {
  return start_ + std::chrono::duration_cast<Clock::duration>(
                      std::chrono::duration<double>(double(frame) / frame_rate_hz_));
}

int Pacing::in_flight() const {
  const std::uint64_t kept = std::min<std::uint64_t>(issued_count_, std::size(issued_));
  int count = 0;
  for (std::uint64_t i = 0; i < kept; ++i)
    count += issued_[(issued_count_ - 1 - i) % std::size(issued_)] > composited_;
  return count;
}

std::optional<std::int64_t> Pacing::next(Clock::time_point now, bool has_renderer) {
  const std::int64_t frame = frame_at(now);
  if (frame <= last_) return std::nullopt;
  if (max_in_flight_ > 0 && has_renderer && in_flight() >= max_in_flight_) {
    if (now - last_progress_ < stall_timeout()) return std::nullopt;
    last_progress_ = now;
    composited_ = last_;
  }
  skipped_ += std::uint64_t(frame - last_ - 1);
  last_ = frame;
  issued_[issued_count_++ % std::size(issued_)] = frame;
  return frame;
}

Pacing::Clock::time_point Pacing::next_wakeup(Clock::time_point now) const {
  return std::max(time_of(last_ + 1), now);
}

void Pacing::composited(std::uint64_t frame, Clock::time_point now) {
  if (std::int64_t(frame) > last_) return;  // a frame of an earlier process
  composited_ = std::max(composited_, std::int64_t(frame));
  last_progress_ = now;
  composited_at_.push_back(now);
  if (composited_at_.size() > kIntervals + 1) composited_at_.pop_front();
}

void Pacing::give_up(std::uint64_t frame, Clock::time_point now) {
  composited_ = std::max(composited_, std::min(std::int64_t(frame), last_));
  last_progress_ = now;
}

Pacing::Clock::duration Pacing::stall_timeout() const {
  if (composited_at_.size() < 2) return kStallTimeout;
  const Clock::duration mean = (composited_at_.back() - composited_at_.front()) /
                               Clock::duration::rep(composited_at_.size() - 1);
  return std::clamp<Clock::duration>(kStallPeriods * mean, kMinStallTimeout, kStallTimeout);
}

std::uint64_t Pacing::take_skipped() { return std::exchange(skipped_, 0); }

}  // namespace fivepipe::capture
