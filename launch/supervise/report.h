// What a deployment did, from the last status of each of its processes and the supervisor's
// history. Pure.
#pragma once
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "launch/supervise/node_status.h"
#include "launch/supervise/supervisor.h"

namespace fivepipe::launch {

struct ReportInput {
  std::string version, commit, build_type;
  std::string cpu;
  int cores = 0;
  std::string deployment;
  std::int64_t start_stamp_ns = 0,
               stop_stamp_ns = 0;  // CLOCK_REALTIME; stop: when the nodes were told to end
  std::optional<std::int64_t> first_composited_stamp_ns;
  std::string ended_by;  // "duration", "SIGINT", "recon_a can't start: ..."
  std::vector<ProgramHistory> programs;
  StatusRegistry statuses;
};

// frames: captured by the busiest capture_node; complete and composited by the slowest recon_node
// and render_node; dropped: summed over all nodes, so that a set missed by two nodes counts twice.
// frame_rate_hz: frames composited after the first one, over the time from it to the stop.
// latency_ms: null where no frame was composited. With a restarted node counts are summed over its
// processes, and latencies are those of the process that handled most frames.
nlohmann::json report_from(const ReportInput& input);

// A short table for people.
std::string table_of(const nlohmann::json& report);

// Frames composited so far, over all processes of the slowest render_node; 0 without one.
std::uint64_t frames_composited(const StatusRegistry& statuses);

}  // namespace fivepipe::launch
