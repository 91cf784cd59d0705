#include "launch/supervise/status_messages.h"

#include <chrono>

namespace fivepipe::launch {
namespace {

std::map<std::string, std::uint64_t> counts_from(const fivepipe_v1_NamedCount* counts,
                                                 std::uint32_t length) {
  std::map<std::string, std::uint64_t> by_name;
  for (std::uint32_t i = 0; i < length; ++i) by_name[counts[i].name] += counts[i].count;
  return by_name;
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
  status.counts = counts_from(message.counts._buffer, message.counts._length);
  status.drops = counts_from(message.drops._buffer, message.drops._length);
  for (std::uint32_t i = 0; i < message.latencies._length; ++i) {
    const fivepipe_v1_LatencySummary& latency = message.latencies._buffer[i];
    status.latencies[latency.name] = {latency.p50_ms, latency.p95_ms, latency.p99_ms,
                                      latency.max_ms, latency.count};
  }
  for (std::uint32_t i = 0; i < message.remarks._length; ++i)
    status.diagnostics.emplace_back(message.remarks._buffer[i]);
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
      registry.writer_gone(sample->node);  // the key is there in samples without data too
  }
}

}  // namespace fivepipe::launch
