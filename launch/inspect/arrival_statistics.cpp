#include "launch/inspect/arrival_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/realtime.h"
#include "common/base/text_table.h"

namespace fivepipe::launch {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMaxGapsShown = 12;

}  // namespace

Quantiles quantiles_of(std::vector<double> values) {
  if (values.empty()) return {kNothing, kNothing, kNothing, kNothing};
  std::sort(values.begin(), values.end());
  const std::size_t count = values.size();
  const double median =
      count % 2 == 1 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
  return {values.front(), median, values[(95 * count + 99) / 100 - 1], values.back()};
}

ArrivalSummary summary_of(const std::deque<Arrival>& arrivals) {
  ArrivalSummary summary{arrivals.size(), kNothing, kNothing, quantiles_of({}), quantiles_of({})};
  std::vector<double> intervals_ms, latencies_ms;
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    latencies_ms.push_back(1e-6 * double(arrivals[i].latency_ns));
    if (i == 0) continue;
    intervals_ms.push_back(
        1e-6 * double(base::difference_ns(arrivals[i].stamp_ns, arrivals[i - 1].stamp_ns)));
    bytes += arrivals[i].bytes;
  }
  if (arrivals.size() >= 2 && arrivals.back().stamp_ns > arrivals.front().stamp_ns) {
    const double time_s = base::difference_s(arrivals.back().stamp_ns, arrivals.front().stamp_ns);
    summary.rate_hz = double(intervals_ms.size()) / time_s;
    summary.bytes_per_s = double(bytes) / time_s;
  }
  summary.interval_ms = quantiles_of(std::move(intervals_ms));
  summary.latency_ms = quantiles_of(std::move(latencies_ms));
  return summary;
}

void FrameGaps::add(std::uint64_t frame) {
  insert(frame);
  if (ranges_ > kMaxRanges) forget_oldest();
}

void FrameGaps::forget_oldest() {
  Ranges& run = runs_.front();
  const auto [first, last] = *run.begin();
  run.erase(run.begin());
  --ranges_;
  forgotten_frames_ += last - first + 1;
  if (run.empty())
    runs_.pop_front();
  else
    forgotten_missing_ += run.begin()->first - last - 1;
}

void FrameGaps::insert(std::uint64_t frame) {
  if (runs_.empty() || frame + kReorderWindow_frames < runs_.back().rbegin()->second)
    runs_.emplace_back();
  Ranges& ranges = runs_.back();
  auto after = ranges.upper_bound(frame);
  if (after != ranges.begin()) {
    const auto before = std::prev(after);
    if (frame <= before->second) return;
    if (frame == before->second + 1) {
      before->second = frame;
      if (after == ranges.end() || after->first != frame + 1) return;
      before->second = after->second;
      ranges.erase(after);
      --ranges_;
      return;
    }
  }
  std::uint64_t last = frame;
  if (after != ranges.end() && after->first == frame + 1) {
    last = after->second;
    ranges.erase(after);
    --ranges_;
  }
  ranges[frame] = last;
  ++ranges_;
}

std::uint64_t FrameGaps::frames() const {
  std::uint64_t count = forgotten_frames_;
  for (const Ranges& ranges : runs_)
    for (const auto& [first, last] : ranges) count += last - first + 1;
  return count;
}

std::uint64_t FrameGaps::missing() const {
  std::uint64_t count = forgotten_missing_;
  for (const Ranges& ranges : runs_) {
    count += ranges.rbegin()->second - ranges.begin()->first + 1;
    for (const auto& [first, last] : ranges) count -= last - first + 1;
  }
  return count;
}

std::string FrameGaps::missing_text(std::size_t max_count) const {
  std::vector<std::string> parts;
  for (const Ranges& ranges : runs_)
    for (auto range = ranges.begin(); std::next(range) != ranges.end(); ++range) {
      const std::uint64_t first = range->second + 1, last = std::next(range)->first - 1;
      if (parts.size() == max_count) return base::joined(parts, ", ") + ", ..";
      parts.push_back(std::to_string(first) + (first == last ? "" : ".." + std::to_string(last)));
    }
  return base::joined(parts, ", ");
}

void ArrivalStatistics::add(const std::string& writer, const Arrival& arrival,
                            std::optional<std::uint64_t> frame) {
  const bool is_named = by_writer_.contains(writer) || by_writer_.size() < kMaxWriters;
  by_writer_[is_named ? writer : "others"].push_back(arrival);
  all_.push_back(arrival);
  if (frame) frames_.add(*frame);
}

void ArrivalStatistics::remove_before(std::int64_t stamp_ns) {
  const auto forget = [&](std::deque<Arrival>& arrivals) {
    while (!arrivals.empty() && arrivals.front().stamp_ns < stamp_ns) arrivals.pop_front();
  };
  for (auto& [writer, arrivals] : by_writer_) forget(arrivals);
  forget(all_);
}

std::string ArrivalStatistics::text() const {
  base::TextTable table({{"writer"},
                         {"messages", true},
                         {"Hz", true},
                         {"MB/s", true},
                         {"interval ms: min", true},
                         {"median", true},
                         {"p95", true},
                         {"max", true},
                         {"latency ms: median", true},
                         {"p95", true},
                         {"max", true}});
  const auto add = [&](const std::string& writer, const std::deque<Arrival>& arrivals) {
    const ArrivalSummary summary = summary_of(arrivals);
    const Quantiles &interval = summary.interval_ms, &latency = summary.latency_ms;
    table.add({writer, std::to_string(summary.messages), base::with_decimals(summary.rate_hz, 2),
               base::with_decimals(1e-6 * summary.bytes_per_s, 3),
               base::with_decimals(interval.min, 2), base::with_decimals(interval.median, 2),
               base::with_decimals(interval.p95, 2), base::with_decimals(interval.max, 2),
               base::with_decimals(latency.median, 2), base::with_decimals(latency.p95, 2),
               base::with_decimals(latency.max, 2)});
  };
  for (const auto& [writer, arrivals] : by_writer_) add(writer, arrivals);
  if (by_writer_.size() > 1) add("all", all_);
  if (frames_.frames() == 0) return table.text();
  const std::string frames = table.text() + base::counted(frames_.frames(), "frame") + ", ";
  if (frames_.missing() == 0) return frames + "none missing\n";
  return frames + std::to_string(frames_.missing()) +
         " missing between them: " + frames_.missing_text(kMaxGapsShown) + "\n";
}

}  // namespace fivepipe::launch
