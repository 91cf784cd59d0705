#include "common/recording/replay/record_session.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "common/base/regex.h"
#include "common/base/timing.h"
#include "common/base/version.h"
#include "common/pipeline/node/status.h"
#include "common/recording/replay/progress.h"
#include "common/recording/replay/recorder.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Counts = std::map<std::string, recording::TopicCounts>;

// Time for messages in transit to arrive after a request to end the recording: at least the first,
// and up to the second while messages are missing that the nodes have counted as sent. A status can
// arrive before messages that were sent earlier.
constexpr auto kMinDrainTime = 200ms, kMaxDrainTime = 800ms;
static_assert(kMaxDrainTime < kWriteTime);

// Reports the totals of each topic in the recorder's NodeStatus.
void publish_counts(node::NodeStatusReporter& status, const Counts& counts) {
  for (const auto& [topic, count] : counts)
    status.recorded(topic, {count.received, count.written, count.lost});
}

void log_progress(const recording::RecordingWriter& recording, double elapsed_s) {
  std::uint64_t received = 0, lost = 0;
  for (const auto& [topic, count] : recording.counts()) {
    received += count.received;
    lost += count.lost;
  }
  spdlog::info("{:.0f} s: {} messages, {:.1f} MB written, {} lost", elapsed_s, received,
               1e-6 * double(recording.bytes_written()), lost);
}

// `signalled`: when the first signal arrived; nullopt if another reason ended the recording. Then
// the disk has any time until a signal arrives.
recording::FinishLimits limits_of(std::optional<Clock::time_point> signalled,
                                  const std::function<int()>& signals_received) {
  const int before = signalled ? 1 : 0;
  const auto is_over = [=](std::chrono::milliseconds time) {
    return signals_received() > before || (signalled && Clock::now() >= *signalled + time);
  };
  return {[=]() -> std::string {
            if (!is_over(kWriteTime)) return "";
            return signals_received() > before
                       ? "the recorder was interrupted before it had written them"
                       : fmt::format("the disk was too slow to take them within {} of the signal",
                                     kWriteTime);
          },
          [=] { return is_over(kIndexTime); }};
}

}  // namespace

std::vector<bus::topics::Topic> topics_to_record(const std::string& expression, bool with_images) {
  const base::Regex wanted(expression);
  std::vector<bus::topics::Topic> chosen;
  for (const bus::topics::Topic& topic : bus::topics::all()) {
    const std::string name = topic.name;
    const bool is_image =
        name == bus::topics::ObjectColour::name || name == bus::topics::HullTile::name;
    // They describe the present, and would mislead the programs that a replay feeds.
    const bool is_of_present =
        name == bus::topics::ReplaySession::name || name == bus::topics::HostStatus::name;
    if (is_of_present && expression.find(name.substr(name.rfind('/') + 1)) == std::string::npos)
      continue;
    if (wanted.found_in(name) && (with_images || !is_image)) chosen.push_back(topic);
  }
  return chosen;
}

bool RecordResult::complete() const {
  std::uint64_t received = 0;
  for (const auto& [topic, count] : counts) {
    if (count.lost > 0 || count.missing > 0) return false;
    received += count.received;
  }
  return failure.empty() && received > 0;
}

RecordResult record(const RecordRequest& request, const std::function<int()>& signals_received) {
  recording::RecordingWriter recording(request.file, std::string("fivepipe ") + base::version(),
                                       request.writer);
  write_header(recording, request.deployment, request.settings, request.domain);
  bus::Bus bus({request.domain, request.network, request.name,
                request.deployment ? request.deployment->name : ""});
  for (const std::string& warning : bus.warnings()) spdlog::warn("{}", warning);
  Recorder recorder(bus, recording, request.topics);
  node::NodeStatusReporter status(bus, request.name);
  spdlog::info("recording {} topics of domain {} to {}; Ctrl-C ends the recording",
               request.topics.size(), request.domain, request.file.string());

  const auto started = Clock::now();
  auto next_progress = started + kProgressPeriod;
  std::optional<Clock::time_point> end_requested, signalled;
  const auto has_drained = [&] {
    const auto since = Clock::now() - *end_requested;
    return since >= kMaxDrainTime ||
           (since >= kMinDrainTime && recorder.unverified_nodes().empty() &&
            std::ranges::all_of(recorder.compared(),
                                [](const SentByNode& sent) { return sent.missing() == 0; }));
  };
  while (!end_requested || !has_drained()) {
    bus.wait(50ms);
    recorder.take();
    const std::string failure = recording.failure();
    if (signals_received() > 0 && !signalled) signalled = Clock::now();
    const bool is_over =
        signals_received() > 0 || !failure.empty() ||
        (request.duration_s > 0 && base::seconds_since(started) >= request.duration_s);
    if (is_over && !end_requested) {
      end_requested = Clock::now();
      if (!failure.empty()) spdlog::error("the recording ends: {}", failure);
    }
    if (Clock::now() < next_progress) continue;
    next_progress += kProgressPeriod;
    publish_counts(status, recording.counts());
    log_progress(recording, base::seconds_since(started));
  }
  RecordResult result;
  result.sent = recorder.compared();
  result.unverified_nodes = recorder.unverified_nodes();
  for (const SentByNode& sent : result.sent)
    recording.add_sent(sent.topic, sent.sent, sent.missing());
  recording.finish(limits_of(signalled, signals_received));
  result.counts = recording.counts();
  if (std::ranges::all_of(result.counts, [](const auto& of) { return of.second.received == 0; }))
    result.why_not_admitted = bus.why_not_admitted();
  publish_counts(status, result.counts);
  result.bytes_written = recording.bytes_written();
  result.elapsed_s = base::seconds_since(started);
  result.loss_reason = recording.loss_reason();
  result.failure = recording.failure();
  result.finished = recording.is_finished();
  result.synced = recording.is_synced() || !request.writer.sync;
  return result;
}

}  // namespace fivepipe::replay
