#include "launch/supervise/status/status_messages.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

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

// A scene has at most one entry of a kind.
template <class Sequence>
auto first_of(const Sequence& sequence) {
  const auto entries = messages::span_of(sequence);
  return entries.empty() ? nullptr : &entries.front();
}

bool is_possible(const SimulatedObjects& objects) {
  const auto is_finite = [](const std::optional<double>& value, double min) {
    return !value || (std::isfinite(*value) && *value >= min);
  };
  return is_finite(objects.kinetic_j, 0) &&
         is_finite(objects.potential_j, std::numeric_limits<double>::lowest()) &&
         is_finite(objects.in_hull_m, 0) && is_finite(objects.in_body_m, 0);
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
  for (const auto& sample : reader.take()) {
    if (!sample.valid() || !(nodes.empty() || nodes.contains(sample->node))) continue;
    if (messages::why_implausible(0, sample->start_stamp_ns))
      registry.ignore();
    else
      registry.add(status_from(*sample, reader.process(sample)), now_ns);
  }
}

std::optional<SimulationStatus> simulation_from(const fivepipe_v1_SimulationMetrics& message) {
  if (messages::why_implausible(message.frame, message.capture_stamp_ns)) return std::nullopt;
  SimulationStatus status{.simulation = message.simulation};
  if (const auto* of = first_of(message.bodies))
    status.of_kind["bodies"] = {.count = of->bodies,
                                .kinetic_j = of->kinetic_j,
                                .potential_j = of->potential_j,
                                .hull_contacts = of->hull_contacts,
                                .body_contacts = of->body_contacts,
                                .in_hull_m = of->deepest_in_hull_m,
                                .in_body_m = of->deepest_in_body_m};
  if (const auto* of = first_of(message.cloths))
    status.of_kind["cloths"] = {.count = of->cloths,
                                .kinetic_j = of->kinetic_j,
                                .potential_j = of->potential_j,
                                .hull_contacts = of->hull_contacts,
                                .in_hull_m = of->deepest_in_hull_m};
  if (const auto* of = first_of(message.particles))
    status.of_kind["particles"] = {.count = of->particles, .hull_contacts = of->hull_contacts};
  for (const auto& [kind, objects] : status.of_kind)
    if (!is_possible(objects)) return std::nullopt;
  return status;
}

void take_metrics(bus::Reader<bus::topics::SimulationMetrics>& reader, SimulationRegistry& registry,
                  const std::set<std::string>& nodes) {
  const std::int64_t now_ns = arrival_clock_ns();
  for (const auto& sample : reader.take()) {
    if (!sample.valid() || !(nodes.empty() || nodes.contains(sample->simulation))) continue;
    if (auto status = simulation_from(*sample))
      registry.add(std::move(*status), now_ns);
    else
      registry.ignore();
  }
}

}  // namespace fivepipe::launch
