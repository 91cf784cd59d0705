#include "launch/supervise/status/status_messages.h"

#include <algorithm>
#include <chrono>

#include "common/base/realtime.h"
#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::launch {
namespace {

template <class Sequence>
auto entries_of(const Sequence& sequence) {
  const auto entries = messages::span_of(sequence);
  return entries.first(std::min(entries.size(), kMaxStatusEntries));
}

// Messages that no reader took and messages that a recorder lost also count as drops.
void add_lost_messages(ProcessStatus& status) {
  for (const auto& [topic, totals] : status.topics) {
    if (totals.not_sent > 0) status.drops["not_sent: " + topic] += totals.not_sent;
    if (totals.lost > 0) status.drops["lost: " + topic] += totals.lost;
  }
}

}  // namespace

ProcessStatus status_from(const fivepipe_v1_NodeStatus& message,
                          std::optional<bus::ProcessId> process) {
  ProcessStatus status;
  status.node = message.node;
  status.process = std::move(process);
  status.version = message.version;
  status.start_stamp_ns = message.start_stamp_ns;
  status.has_handled_frame = message.has_handled_frame;
  status.final_report = message.final_report;
  status.frame = message.frame;
  status.frame_rate_hz = message.frame_rate_hz;
  status.cpu_s = message.cpu_s;
  status.memory_mb = message.memory_mb;
  status.gl_renderer = message.gl_renderer;
  for (const auto& count : entries_of(message.counts)) status.counts[count.name] += count.count;
  for (const auto& drop : entries_of(message.drops))
    status.drops[messages::text_of({drop.reason, drop.subject, drop.detail})] += drop.count;
  for (const auto& topic : entries_of(message.topics))
    status.topics[topic.topic] = {topic.sent, topic.not_sent, topic.received, topic.recorded,
                                  topic.lost};
  for (const auto& camera : entries_of(message.empty_cameras))
    status.empty_cameras[camera.camera] = camera.frames;
  for (const auto& object : entries_of(message.collisions))
    status.collisions[object.object] = {object.frames, object.points, object.first_contacts};
  for (const auto& latency : entries_of(message.latencies))
    status.latencies[latency.name] = {latency.p50_ms, latency.p95_ms, latency.p99_ms,
                                      latency.max_ms, latency.count};
  for (const auto& diagnostic : entries_of(message.diagnostics))
    status.diagnostics.push_back(std::string(diagnostic.subject) + ": " + diagnostic.text);
  add_lost_messages(status);
  return status;
}

std::int64_t arrival_clock_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void take_statuses(bus::Reader<bus::topics::NodeStatus>& reader, StatusRegistry& registry,
                   const std::set<std::string>& nodes) {
  const std::int64_t now_ns = arrival_clock_ns();
  const std::int64_t latest_start_ns = base::now_realtime_ns() + kMaxClockDifference_ns;
  for (const auto& sample : reader.take()) {
    if (!sample.valid() || !(nodes.empty() || nodes.contains(sample->node))) continue;
    if (messages::why_implausible(0, sample->start_stamp_ns) ||
        sample->start_stamp_ns > latest_start_ns)
      registry.ignore();
    else
      registry.add(status_from(*sample, reader.process(sample)), now_ns);
  }
}

}  // namespace fivepipe::launch
