// How regularly messages come: rate, intervals, latencies, gaps in frame numbers. Pure.
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::launch {

struct Arrival {
  std::int64_t stamp_ns = 0;    // when it was taken
  std::int64_t latency_ns = 0;  // from its source stamp to there
  std::uint64_t bytes = 0;
};

// least, median, 95 % quantile (nearest rank) and most; all NaN of no values.
struct Quantiles {
  double min, median, p95, max;
};
Quantiles quantiles_of(std::vector<double> values);

struct ArrivalSummary {
  std::uint64_t messages = 0;
  double rate_hz = 0;  // intervals over the time from the first to the last; NaN below two messages
  double bytes_per_s = 0;  // likewise, without the first message; NaN
  Quantiles interval_ms{}, latency_ms{};
};
ArrivalSummary summary_of(const std::deque<Arrival>& arrivals);

// Frame numbers between the first and the last that never came. A number that is much lower than
// the newest is of a new start.
class FrameGaps {
 public:
  // Messages of so many frames may come interleaved.
  static constexpr std::uint64_t kReorderWindow_frames = 24;

  void add(std::uint64_t frame);
  std::uint64_t frames() const;  // different ones
  std::uint64_t missing() const;
  // For people: "17, 40..42"; at most `max_count` of them, then "..".
  std::string missing_text(std::size_t max_count) const;

 private:
  using Ranges = std::map<std::uint64_t, std::uint64_t>;  // first -> last of frames that came,
                                                          // apart from one another
  std::vector<Ranges> runs_;                              // by start
};

// Of one topic, by writer and of all together.
class ArrivalStatistics {
 public:
  // frame: where the message is of one.
  void add(const std::string& writer, const Arrival& arrival, std::optional<std::uint64_t> frame);
  // Arrivals only: frames stay counted.
  void remove_before(std::int64_t stamp_ns);
  std::uint64_t messages() const { return all_.size(); }
  // A table for 120 columns, and which frames are missing among those of all writers.
  std::string text() const;

 private:
  std::map<std::string, std::deque<Arrival>> by_writer_;
  std::deque<Arrival> all_;
  FrameGaps frames_;
};

}  // namespace fivepipe::launch
