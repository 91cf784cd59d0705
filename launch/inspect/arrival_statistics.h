// Statistics of message arrivals: rate, intervals, latencies and gaps in frame numbers.
// Independent of DDS.
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::launch {

struct Arrival {
  std::int64_t stamp_ns = 0;    // when the message was received
  std::int64_t latency_ns = 0;  // from its source stamp to that time
  std::uint64_t bytes = 0;
};

// Minimum, median, 95 % quantile (nearest rank) and maximum; all NaN if there are no values.
struct Quantiles {
  double min, median, p95, max;
};
Quantiles quantiles_of(std::vector<double> values);

struct ArrivalSummary {
  std::uint64_t messages = 0;
  // Number of intervals over the time from the first to the last message; NaN below two messages.
  double rate_hz = 0;
  double bytes_per_s = 0;  // over the same time, without the first message; NaN below two messages
  Quantiles interval_ms{}, latency_ms{};
};
ArrivalSummary summary_of(const std::deque<Arrival>& arrivals);

// Finds missing frame numbers between the first and the last. A number far below the newest one
// begins a new run.
class FrameGaps {
 public:
  // Messages of up to this many frames may be interleaved.
  static constexpr std::uint64_t kReorderWindow_frames = 24;
  // At most this many contiguous ranges are kept; the oldest ones only count. A writer can send any
  // frame numbers.
  static constexpr std::size_t kMaxRanges = 10'000;

  void add(std::uint64_t frame);
  std::uint64_t frames() const;  // number of distinct frames
  std::uint64_t missing() const;
  // Missing frames of the kept ranges such as "17, 40..42"; at most `max_count` ranges, then "..".
  std::string missing_text(std::size_t max_count) const;

 private:
  void insert(std::uint64_t frame);
  void forget_oldest();

  // First -> last frame of each contiguous range.
  using Ranges = std::map<std::uint64_t, std::uint64_t>;
  std::deque<Ranges> runs_;  // in the order of their beginnings
  std::size_t ranges_ = 0;   // in all runs
  std::uint64_t forgotten_frames_ = 0, forgotten_missing_ = 0;
};

// Statistics of one topic, by writer and in total.
class ArrivalStatistics {
 public:
  // Further writers count together as "others".
  static constexpr std::size_t kMaxWriters = 64;

  // `frame`: nullopt if the message belongs to no frame.
  void add(const std::string& writer, const Arrival& arrival, std::optional<std::uint64_t> frame);
  // Removes older arrivals. Their frames stay counted.
  void remove_before(std::int64_t stamp_ns);
  std::uint64_t messages() const { return all_.size(); }
  // A table for 120 columns, then the frames that are missing from all writers together.
  std::string text() const;

 private:
  std::map<std::string, std::deque<Arrival>> by_writer_;
  std::deque<Arrival> all_;
  FrameGaps frames_;
};

}  // namespace fivepipe::launch
