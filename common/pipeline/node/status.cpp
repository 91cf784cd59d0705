#include "common/pipeline/node/status.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
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
#include "common/pipeline/node/log_budget.h"
#include "common/pipeline/node/node_state.h"
#include "common/pipeline/node/status_names.h"

namespace fivepipe::node {
namespace {

using messages::set_truncated;

constexpr std::chrono::milliseconds kPublishPeriod{500};
// Minimum time between statuses, if a new diagnostic does not wait for kPublishPeriod.
constexpr std::chrono::milliseconds kMinPublishPeriod{100};
constexpr std::chrono::seconds kDropLogPeriod{1};
constexpr double kRateWindow_s = 1.0;
// Bounds the memory of a node that handles frames faster than this within kRateWindow_s.
constexpr std::size_t kMaxFrameTimes = 4096;

using Clock = std::chrono::steady_clock;

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  std::size_t total = 0, resident = 0;
  statm >> total >> resident;
  return double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6;
}

}  // namespace

struct NodeStatusReporter::Impl {
  std::string node;
  bus::Bus& bus;
  bus::Writer<bus::topics::NodeStatus> writer;
  CaptureClock* clock;
  std::int64_t start_stamp_ns = base::now_realtime_ns();

  std::mutex mutex;
  std::condition_variable wake;
  bool ending = false;
  bool has_new_diagnostic = false;  // since the newest status
  NodeState state;
  std::map<messages::BadMessage, Clock::time_point> drop_logged;  // has the keys of state.drops
  LogBudget log_budget;
  std::optional<Clock::time_point> uncorrected_since;  // latencies lack a compared clock since then
  std::thread publisher;

  Impl(bus::Bus& b, std::string n, CaptureClock* c)
      : node(std::move(n)), bus(b), writer(b.writer<bus::topics::NodeStatus>()), clock(c) {}

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

  void update_clock() {
    if (!clock) return;
    clock->update();
    const std::scoped_lock lock(mutex);
    if (clock->offset_ns()) uncorrected_since.reset();
    const bool is_problem = uncorrected_since && Clock::now() - *uncorrected_since >
                                                     NodeStatusReporter::kComparisonPatience;
    const std::string problem =
        is_problem ? clock->not_compared_text(NodeStatusReporter::kComparisonPatience) : "";
    if (set_diagnostic("clock", problem)) spdlog::warn("clock: {}", problem);
  }

  void publish_until_ending() {
    std::unique_lock lock(mutex);
    while (!ending) {
      lock.unlock();
      for (const std::string& problem : bus.problems()) spdlog::error("{}", problem);
      collect_sent();
      count_refused();
      update_clock();
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

NodeStatusReporter::NodeStatusReporter(bus::Bus& bus, std::string node, CaptureClock* clock)
    : impl_(std::make_unique<Impl>(bus, std::move(node), clock)) {
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

void NodeStatusReporter::latency_since_capture(const std::string& name,
                                               std::int64_t capture_stamp_ns, std::int64_t now_ns) {
  const std::optional<std::int64_t> offset_ns =
      impl_->clock ? impl_->clock->offset_ns() : std::optional<std::int64_t>(0);
  latency(offset_ns ? name : name + kNotCompared,
          base::difference_s(now_ns + offset_ns.value_or(0), capture_stamp_ns));
  if (offset_ns) return;
  const std::scoped_lock lock(impl_->mutex);
  if (!impl_->uncorrected_since) impl_->uncorrected_since = Clock::now();
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
