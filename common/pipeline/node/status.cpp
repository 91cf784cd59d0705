#include "common/pipeline/node/status.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "common/base/realtime.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/base/version.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/node/drop_counts.h"
#include "common/pipeline/node/log_budget.h"
#include "common/pipeline/node/status_names.h"

namespace fivepipe::node {
namespace {

constexpr std::chrono::milliseconds kPublishPeriod{500};
// Minimum time between statuses, if a new diagnostic does not wait for kPublishPeriod.
constexpr std::chrono::milliseconds kMinPublishPeriod{100};
constexpr std::chrono::seconds kDropLogPeriod{1};
// At most this many senders of refused messages are named.
constexpr std::size_t kMaxSenders = 16;
constexpr std::size_t kLatencySamples = 1 << 14;  // the newest per name: nine minutes at 30 Hz
constexpr double kRateWindow_s = 1.0;
// Bounds the memory of a node that handles frames faster than this within kRateWindow_s.
constexpr std::size_t kMaxFrameTimes = 4096;

using Clock = std::chrono::steady_clock;

// People read statuses: a truncated text is better than none.
template <std::size_t N>
void set_truncated(char (&field)[N], const std::string& text) {
  const std::size_t n = std::min(text.size(), N - 1);
  std::memcpy(field, text.data(), n);
  field[n] = '\0';
}

// Returns the q quantile (0..1). `sorted` must not be empty.
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

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  std::size_t total = 0, resident = 0;
  statm >> total >> resident;
  return double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6;
}

struct CollisionTotals {
  std::uint64_t frames = 0, points = 0, first_contacts = 0;
};
struct TopicTotals {
  std::uint64_t sent = 0, not_sent = 0;
  RecordedCounts recorded;
};

// The node's state that a status reports.
struct NodeState {
  std::uint64_t newest_frame = 0;
  bool has_handled_frame = false;
  double cpu_at_first_frame_s = 0;  // of the process; valid if has_handled_frame
  std::deque<Clock::time_point> frame_times;
  std::string gl_renderer;
  std::map<std::string, std::uint64_t> counts, empty_cameras;
  DropCounts drops;
  NamedCounts refused{kMaxSenders, std::string(kRefusedFrom) + "other processes"};
  std::map<std::string, TopicTotals> topics;
  std::map<std::string, CollisionTotals> collisions;
  std::map<std::string, LatencyWindow> latencies;
  std::map<std::string, std::string> diagnostics;  // by subject
};

fivepipe_v1_DropCount drop_count(const messages::BadMessage& bad, std::uint64_t n) {
  fivepipe_v1_DropCount drop{};
  set_truncated(drop.reason, bad.reason);
  set_truncated(drop.subject, bad.subject);
  set_truncated(drop.detail, bad.detail);
  drop.count = n;
  return drop;
}

fivepipe_v1_TopicCounts topic_counts(const std::string& topic, const TopicTotals& totals) {
  fivepipe_v1_TopicCounts counts{};
  set_truncated(counts.topic, topic);
  counts.sent = totals.sent;
  counts.not_sent = totals.not_sent;
  counts.received = totals.recorded.received;
  counts.recorded = totals.recorded.recorded;
  counts.lost = totals.recorded.lost;
  return counts;
}

fivepipe_v1_LatencySummary latency_summary(const std::string& name, const LatencyWindow& window) {
  std::vector<float> sorted = window.newest_ms;
  std::sort(sorted.begin(), sorted.end());
  fivepipe_v1_LatencySummary summary{};
  set_truncated(summary.name, name);
  summary.p50_ms = quantile(sorted, 0.50);
  summary.p95_ms = quantile(sorted, 0.95);
  summary.p99_ms = quantile(sorted, 0.99);
  summary.max_ms = sorted.back();
  summary.count = window.count;
  return summary;
}

// The sequences of a NodeStatus with their storage.
struct StatusLists {
  std::vector<fivepipe_v1_NamedCount> counts;
  std::vector<fivepipe_v1_DropCount> drops;
  std::vector<fivepipe_v1_TopicCounts> topics;
  std::vector<fivepipe_v1_EmptyCameraCount> empty_cameras;
  std::vector<fivepipe_v1_ObjectCollisionCounts> collisions;
  std::vector<fivepipe_v1_LatencySummary> latencies;
  std::vector<fivepipe_v1_Diagnostic> diagnostics;

  explicit StatusLists(const NodeState& state) {
    for (const auto* named : {&state.counts, &state.refused.counts()})
      for (const auto& [name, n] : *named) {
        set_truncated(counts.emplace_back().name, name);
        counts.back().count = n;
      }
    for (const auto& [bad, n] : state.drops.counts()) drops.push_back(drop_count(bad, n));
    for (const auto& [topic, totals] : state.topics) topics.push_back(topic_counts(topic, totals));
    for (const auto& [camera, frames] : state.empty_cameras) {
      set_truncated(empty_cameras.emplace_back().camera, camera);
      empty_cameras.back().frames = frames;
    }
    for (const auto& [object, totals] : state.collisions) {
      fivepipe_v1_ObjectCollisionCounts& entry = collisions.emplace_back();
      set_truncated(entry.object, object);
      entry.frames = totals.frames;
      entry.points = totals.points;
      entry.first_contacts = totals.first_contacts;
    }
    for (const auto& [name, window] : state.latencies)
      latencies.push_back(latency_summary(name, window));
    for (const auto& [subject, text] : state.diagnostics) {
      set_truncated(diagnostics.emplace_back().subject, subject);
      set_truncated(diagnostics.back().text, text);
    }
  }

  void lend_to(fivepipe_v1_NodeStatus& message) {
    messages::borrow(message.counts, counts);
    messages::borrow(message.drops, drops);
    messages::borrow(message.topics, topics);
    messages::borrow(message.empty_cameras, empty_cameras);
    messages::borrow(message.collisions, collisions);
    messages::borrow(message.latencies, latencies);
    messages::borrow(message.diagnostics, diagnostics);
  }
};

}  // namespace

struct NodeStatusReporter::Impl {
  std::string node;
  bus::Bus& bus;
  bus::Writer<bus::topics::NodeStatus> writer;
  std::int64_t start_stamp_ns = base::now_realtime_ns();

  std::mutex mutex;
  std::condition_variable wake;
  bool ending = false;
  bool has_new_diagnostic = false;  // since the newest status
  NodeState state;
  std::map<messages::BadMessage, Clock::time_point> drop_logged;  // has the keys of state.drops
  LogBudget log_budget;
  std::thread publisher;

  Impl(bus::Bus& b, std::string n)
      : node(std::move(n)), bus(b), writer(b.writer<bus::topics::NodeStatus>()) {}

  void publish(bool final_report) {
    std::unique_lock lock(mutex);
    const Clock::time_point now = Clock::now();
    while (!state.frame_times.empty() &&
           now - state.frame_times.front() > std::chrono::duration<double>(kRateWindow_s))
      state.frame_times.pop_front();
    fivepipe_v1_NodeStatus message{};
    set_truncated(message.node, node);
    set_truncated(message.version, base::version());
    message.start_stamp_ns = start_stamp_ns;
    message.has_handled_frame = state.has_handled_frame;
    message.final_report = final_report;
    message.frame = state.newest_frame;
    message.frame_rate_hz = double(state.frame_times.size()) / kRateWindow_s;
    message.cpu_s = base::process_cpu_s();
    message.memory_mb = resident_mb();
    if (state.has_handled_frame)
      state.counts[kFramesCpu] =
          std::uint64_t(std::max(0.0, 1e6 * (message.cpu_s - state.cpu_at_first_frame_s)));
    set_truncated(message.gl_renderer, state.gl_renderer);
    StatusLists lists(state);
    has_new_diagnostic = false;
    lock.unlock();
    lists.lend_to(message);
    try {
      writer.write(message);
    } catch (const bus::BusError& error) {
      spdlog::warn("cannot send the node status: {}", error.what());
    }
  }

  // Returns whether there is a new text. Call with `mutex` locked.
  bool set_diagnostic(const std::string& subject, const std::string& text) {
    if (text.empty()) {
      state.diagnostics.erase(subject);
      return false;
    }
    if (std::exchange(state.diagnostics[subject], text) == text) return false;
    has_new_diagnostic = true;
    wake.notify_all();
    return true;
  }

  void collect_sent() {
    const auto not_sent = bus.take_not_sent(), sent = bus.sent();
    const std::scoped_lock lock(mutex);
    for (const auto& [topic, count] : sent) state.topics[topic].sent = count;
    for (const auto& [topic, count] : not_sent) state.topics[topic].not_sent += count;
  }

  void drop(const messages::BadMessage& bad, std::uint64_t n) {
    if (n == 0) return;
    const std::scoped_lock lock(mutex);
    const auto& [counted, total] = state.drops.add(bad, n);
    const Clock::time_point now = Clock::now();
    Clock::time_point& logged = drop_logged[counted];
    if (now - logged < kDropLogPeriod || !log_budget.take(now)) return;
    logged = now;
    spdlog::warn("dropped: {} ({} so far)", base::printable(messages::text_of(counted)), total);
  }

  void refuse(const std::optional<bus::ProcessId>& sender, std::uint64_t n) {
    const std::scoped_lock lock(mutex);
    state.refused.add(kRefusedFrom + bus::text_of(sender), n);
  }

  void count_refused() {
    for (const bus::RefusedSamples& refused : bus.take_refused()) {
      if (refused.reason == bus::RefusedSamples::Reason::other_deployment)
        drop({"other_deployment", refused.topic, bus::text_of(refused)}, refused.count);
      else
        drop({"too_many_keys", refused.topic, ""}, refused.count);
      refuse(refused.process, refused.count);
    }
  }

  void publish_until_ending() {
    std::unique_lock lock(mutex);
    while (!ending) {
      lock.unlock();
      for (const std::string& problem : bus.problems()) spdlog::error("{}", problem);
      collect_sent();
      count_refused();
      publish(false);
      lock.lock();
      if (const std::uint64_t lines = log_budget.take_suppressed(Clock::now()))
        spdlog::warn("{} more lines are not logged; see `fivepipe top` or report.json", lines);
      const Clock::time_point published = Clock::now();
      wake.wait_until(lock, published + kPublishPeriod,
                      [this] { return ending || has_new_diagnostic; });
      wake.wait_until(lock, published + kMinPublishPeriod, [this] { return ending; });
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
  impl_->count_refused();
  impl_->publish(true);
}

void NodeStatusReporter::count(const std::string& name, std::uint64_t n) {
  const std::scoped_lock lock(impl_->mutex);
  impl_->state.counts[name] += n;
}

void NodeStatusReporter::drop(const messages::BadMessage& bad, std::uint64_t n) {
  impl_->drop(bad, n);
}

void NodeStatusReporter::refuse(const std::optional<bus::ProcessId>& sender, std::uint64_t n) {
  impl_->refuse(sender, n);
}

void NodeStatusReporter::drop_from(const std::optional<bus::ProcessId>& sender,
                                   const messages::BadMessage& bad) {
  drop(bad);
  refuse(sender, 1);
}

void NodeStatusReporter::latency(const std::string& name, double seconds) {
  const std::scoped_lock lock(impl_->mutex);
  impl_->state.latencies[name].add(1e3 * seconds);
}

void NodeStatusReporter::frame_handled(std::uint64_t frame) {
  const std::scoped_lock lock(impl_->mutex);
  NodeState& state = impl_->state;
  state.newest_frame = frame;
  if (!state.has_handled_frame) state.cpu_at_first_frame_s = base::process_cpu_s();
  state.has_handled_frame = true;
  state.frame_times.push_back(Clock::now());
  if (state.frame_times.size() > kMaxFrameTimes) state.frame_times.pop_front();
}

void NodeStatusReporter::empty_camera(const std::string& camera) {
  const std::scoped_lock lock(impl_->mutex);
  ++impl_->state.empty_cameras[camera];
}

void NodeStatusReporter::collided(const std::string& object, std::uint64_t points) {
  const std::scoped_lock lock(impl_->mutex);
  CollisionTotals& totals = impl_->state.collisions[object];
  ++totals.frames;
  totals.points += points;
}

void NodeStatusReporter::first_contact(const std::string& object) {
  const std::scoped_lock lock(impl_->mutex);
  ++impl_->state.collisions[object].first_contacts;
}

void NodeStatusReporter::recorded(const std::string& topic, const RecordedCounts& totals) {
  const std::scoped_lock lock(impl_->mutex);
  impl_->state.topics[topic].recorded = totals;
}

void NodeStatusReporter::set_gl_renderer(const std::string& renderer) {
  spdlog::info("OpenGL: {}", renderer);
  const std::scoped_lock lock(impl_->mutex);
  impl_->state.gl_renderer = renderer;
}

void NodeStatusReporter::diagnostic(const std::string& subject, const std::string& text) {
  const std::scoped_lock lock(impl_->mutex);
  if (impl_->set_diagnostic(subject, text) && impl_->log_budget.take(Clock::now()))
    spdlog::info("{}: {}", subject, base::printable(text));
}

void NodeStatusReporter::start_progress(const std::string& text) {
  const std::scoped_lock lock(impl_->mutex);
  if (impl_->set_diagnostic(kStart, text)) spdlog::info("{}: {}", kStart, text);
}

std::string empty_hull_text(const std::vector<std::string>& cameras, const hull::HullRule& rule,
                            std::size_t shape_cameras) {
  const bool is_empty = rule.limits == hull::Limits::all
                            ? !cameras.empty()
                            : shape_cameras < cameras.size() + std::size_t(rule.min_seen);
  if (!is_empty) return "";
  if (cameras.empty())
    return fmt::format("empty: only {} cameras have a map, min_seen is {}", shape_cameras,
                       rule.min_seen);
  return fmt::format("empty: no object pixel in camera {}", fmt::join(cameras, ", "));
}

}  // namespace fivepipe::node
