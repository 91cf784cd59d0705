#include "launch/supervise/status_messages.h"

#include <chrono>

#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::launch {
namespace {

using messages::span_of;

// Messages that no reader took and messages that a recorder lost also count as drops.
void add_lost_messages(ProcessStatus& status) {
  for (const auto& [topic, totals] : status.topics) {
    if (totals.not_sent > 0) status.drops["not_sent: " + topic] += totals.not_sent;
    if (totals.lost > 0) status.drops["lost: " + topic] += totals.lost;
  }
}

}  // namespace

ProcessStatus status_from(const fivepipe_v1_NodeStatus& message, std::uint64_t writer) {
  ProcessStatus status;
  status.node = message.node;
  status.writer = writer;
  status.version = message.version;
  status.start_stamp_ns = message.start_stamp_ns;
  status.has_handled_frame = message.has_handled_frame;
  status.final_report = message.final_report;
  status.frame = message.frame;
  status.frame_rate_hz = message.frame_rate_hz;
  status.cpu_s = message.cpu_s;
  status.memory_mb = message.memory_mb;
  status.gl_renderer = message.gl_renderer;
  for (const auto& count : span_of(message.counts)) status.counts[count.name] += count.count;
  for (const auto& drop : span_of(message.drops))
    status.drops[messages::text_of({drop.reason, drop.subject, drop.detail})] += drop.count;
  for (const auto& topic : span_of(message.topics))
    status.topics[topic.topic] = {topic.sent, topic.not_sent, topic.received, topic.recorded,
                                  topic.lost};
  for (const auto& camera : span_of(message.empty_cameras))
    status.empty_cameras[camera.camera] = camera.frames;
  for (const auto& object : span_of(message.collisions))
    status.collisions[object.object] = {object.frames, object.points, object.first_contacts};
  for (const auto& latency : span_of(message.latencies))
    status.latencies[latency.name] = {latency.p50_ms, latency.p95_ms, latency.p99_ms,
                                      latency.max_ms, latency.count};
  for (const auto& diagnostic : span_of(message.diagnostics))
    status.diagnostics.push_back(std::string(diagnostic.subject) + ": " + diagnostic.text);
  add_lost_messages(status);
  return status;
}

void take_statuses(bus::Reader<bus::topics::NodeStatus>& reader, StatusRegistry& registry,
                   const std::set<std::string>& nodes) {
  const std::int64_t now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                  std::chrono::system_clock::now().time_since_epoch())
                                  .count();
  for (const auto& sample : reader.take()) {
    if (!nodes.empty() && !nodes.contains(sample->node)) continue;
    if (sample.valid()) registry.add(status_from(*sample, sample.writer()), now_ns);
    if (sample.writer_gone())
      registry.writer_gone(sample->node);  // a sample without data has the key
  }
}

}  // namespace fivepipe::launch
