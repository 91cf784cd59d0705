#include "common/pipeline/node/status.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>

#include "common/base/realtime.h"
#include "common/base/version.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::node {
namespace {

constexpr std::chrono::milliseconds kPublishPeriod{500};
constexpr std::size_t kLatencySamples = 1 << 14;  // newest kept per name: nine minutes at 30 Hz
constexpr double kRateWindow_s = 1.0;

using Clock = std::chrono::steady_clock;

// Statuses are for people: what is too long is cut.
template <std::size_t N>
void set_truncated(char (&field)[N], const std::string& text) {
  const std::size_t n = std::min(text.size(), N - 1);
  std::memcpy(field, text.data(), n);
  field[n] = '\0';
}

// The sample below which a fraction q of them lies. `sorted` is not empty.
double quantile(const std::vector<float>& sorted, double q) {
  return sorted[std::min(sorted.size() - 1, std::size_t(q * double(sorted.size())))];
}

struct LatencyWindow {
  std::vector<float> newest_ms;
  std::uint64_t count = 0;
  void add(double ms) {
    if (newest_ms.size() < kLatencySamples)
      newest_ms.push_back(float(ms));
    else
      newest_ms[count % kLatencySamples] = float(ms);
    ++count;
  }
};

double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  std::size_t total = 0, resident = 0;
  statm >> total >> resident;
  return double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6;
}

std::vector<fivepipe_v1_NamedCount> named_counts(
    const std::map<std::string, std::uint64_t>& counts) {
  std::vector<fivepipe_v1_NamedCount> named(counts.size());
  std::size_t i = 0;
  for (const auto& [name, n] : counts) {
    set_truncated(named[i].name, name);
    named[i++].count = n;
  }
  return named;
}

}  // namespace

struct NodeStatusReporter::Impl {
  std::string node;
  bus::Bus& bus;
  bus::Writer<bus::topics::NodeStatus> writer;
  std::int64_t start_stamp_ns = base::now_realtime_ns();

  std::mutex mutex;
  std::condition_variable wake;
  bool ending = false;
  std::uint64_t newest_frame = 0;
  bool has_handled_frame = false;
  std::deque<Clock::time_point> frame_times;
  std::map<std::string, std::uint64_t> counts, drops;
  std::map<std::string, Clock::time_point> drop_logged;
  std::map<std::string, LatencyWindow> latencies;
  std::map<std::string, std::string> diagnostics;
  std::thread publisher;

  Impl(bus::Bus& b, std::string n)
      : node(std::move(n)), bus(b), writer(b.writer<bus::topics::NodeStatus>()) {}

  void publish(bool final_report) {
    fivepipe_v1_NodeStatus message{};
    std::vector<fivepipe_v1_NamedCount> count_list, drop_list;
    std::vector<fivepipe_v1_LatencySummary> latency_list;
    struct Remark {
      char text[257];
    };
    std::vector<Remark> diagnostic_list;
    {
      const std::scoped_lock lock(mutex);
      set_truncated(message.node, node);
      set_truncated(message.version, base::version());
      message.start_stamp_ns = start_stamp_ns;
      message.has_handled_frame = has_handled_frame;
      message.final_report = final_report;
      message.frame = newest_frame;
      const Clock::time_point now = Clock::now();
      while (!frame_times.empty() &&
             now - frame_times.front() > std::chrono::duration<double>(kRateWindow_s))
        frame_times.pop_front();
      message.frame_rate_hz = double(frame_times.size()) / kRateWindow_s;
      message.cpu_s = cpu_s();
      message.memory_mb = resident_mb();
      count_list = named_counts(counts);
      drop_list = named_counts(drops);
      for (const auto& [name, window] : latencies) {
        std::vector<float> sorted = window.newest_ms;
        std::sort(sorted.begin(), sorted.end());
        fivepipe_v1_LatencySummary summary{};
        set_truncated(summary.name, name);
        summary.p50_ms = quantile(sorted, 0.50);
        summary.p95_ms = quantile(sorted, 0.95);
        summary.p99_ms = quantile(sorted, 0.99);
        summary.max_ms = sorted.back();
        summary.count = window.count;
        latency_list.push_back(summary);
      }
      for (const auto& [topic, text] : diagnostics)
        set_truncated(diagnostic_list.emplace_back().text, text);
    }
    messages::borrow(message.counts, count_list);
    messages::borrow(message.drops, drop_list);
    messages::borrow(message.latencies, latency_list);
    message.remarks._length = message.remarks._maximum = std::uint32_t(diagnostic_list.size());
    message.remarks._buffer = diagnostic_list.empty() ? nullptr : &diagnostic_list.front().text;
    try {
      writer.write(message);
    } catch (const bus::BusError& error) {
      spdlog::warn("status not sent: {}", error.what());
    }
  }

  void collect_sent() {
    const auto not_sent = bus.take_not_sent(), sent = bus.sent();
    const std::scoped_lock lock(mutex);
    for (const auto& [topic, count] : sent) counts[kSentPrefix + topic] = count;
    for (const auto& [topic, count] : not_sent) drops["not_sent: " + topic] += count;
  }

  void publish_until_ending() {
    std::unique_lock lock(mutex);
    while (!ending) {
      lock.unlock();
      for (const std::string& problem : bus.problems()) spdlog::error("{}", problem);
      collect_sent();
      publish(false);
      lock.lock();
      wake.wait_for(lock, kPublishPeriod, [this] { return ending; });
    }
  }
};

NodeStatusReporter::NodeStatusReporter(bus::Bus& bus, std::string node)
    : impl_(std::make_unique<Impl>(bus, std::move(node))) {
  impl_->publisher = std::thread([this] { impl_->publish_until_ending(); });
}

NodeStatusReporter::~NodeStatusReporter() {
  {
    const std::scoped_lock lock(impl_->mutex);
    impl_->ending = true;
  }
  impl_->wake.notify_all();
  impl_->publisher.join();
  impl_->collect_sent();
  impl_->publish(true);
}

void NodeStatusReporter::count(const std::string& name, std::uint64_t n) {
  const std::scoped_lock lock(impl_->mutex);
  impl_->counts[name] += n;
}

void NodeStatusReporter::drop(const std::string& reason, std::uint64_t n) {
  if (n == 0) return;
  const std::scoped_lock lock(impl_->mutex);
  impl_->drops[reason] += n;
  Clock::time_point& logged = impl_->drop_logged[reason];
  if (Clock::now() - logged < std::chrono::seconds(1)) return;
  logged = Clock::now();
  spdlog::warn("dropped: {} ({} so far)", reason, impl_->drops[reason]);
}

void NodeStatusReporter::latency(const std::string& name, double seconds) {
  const std::scoped_lock lock(impl_->mutex);
  impl_->latencies[name].add(1e3 * seconds);
}

void NodeStatusReporter::frame_handled(std::uint64_t frame) {
  const std::scoped_lock lock(impl_->mutex);
  impl_->newest_frame = frame;
  impl_->has_handled_frame = true;
  impl_->frame_times.push_back(Clock::now());
  if (impl_->frame_times.size() > 4096) impl_->frame_times.pop_front();
}

void NodeStatusReporter::diagnostic(const std::string& topic, const std::string& text) {
  const std::scoped_lock lock(impl_->mutex);
  if (text.empty()) {
    impl_->diagnostics.erase(topic);
    return;
  }
  std::string& standing = impl_->diagnostics[topic];
  if (standing != text) spdlog::info("{}", text);
  standing = text;
}

}  // namespace fivepipe::node
