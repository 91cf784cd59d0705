// The report of a deployment, from the newest status of each process and the supervisor's history.
// Pure.
#pragma once
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "launch/supervise/hosts/host_checks.h"
#include "launch/supervise/status/node_status.h"
#include "launch/supervise/status/simulation_status.h"
#include "launch/supervise/supervisor.h"

namespace fivepipe::launch {

struct RecorderHistory {
  std::string file;
  std::string name;  // on the bus
  pid_t pid = 0;
  std::string end;        // how it ended
  bool complete = false;  // the recording has every message
  // Since the start of the deployment, if the recorder ended before the deployment.
  std::optional<double> ended_after_s;
};

struct ReportInput {
  std::string version, commit, build_type;
  std::string cpu;
  int cores = 0;                            // of this host
  std::optional<double> requested_rate_hz;  // nullopt: as fast as possible
  std::string deployment;
  std::int64_t start_stamp_ns = 0;  // CLOCK_REALTIME
  std::int64_t stop_stamp_ns = 0;   // when the supervisor began to stop the nodes
  std::optional<std::int64_t> first_composited_stamp_ns;
  std::string ended_by;  // "duration", "SIGINT", "recon_a cannot start: ..."
  std::vector<ProgramHistory> programs;
  std::optional<RecorderHistory> recorder;  // nullopt: nothing was to be recorded
  StatusRegistry statuses;                  // of the programs and of the recorder
  SimulationRegistry simulations = {};
  std::vector<ComparedHost> hosts = {};        // the others that have spoken
  std::map<std::string, std::uint64_t> drops;  // of `fivepipe up`, by text_of(BadMessage)
};

// frames.captured: of the busiest capture_node. frames.complete, frames.composited: of the slowest
// recon_node and render_node. frames.dropped: summed over all nodes and `fivepipe up`, so that a
// set that two nodes miss counts twice. frame_rate_hz: frames composited after the first one,
// divided by the time from the first one to the stop. latency_ms: of the slowest render_node; null
// if no frame was composited, or if its clock is not compared with that of the capture. Counts of a
// restarted node are sums over its processes; its latencies are those of the process that handled
// the most frames. hosts: the others, each with how far its clock was ahead at the end; null if the
// clocks were not compared. core_ms_per_set, rate_bound: work_per_set.h.
nlohmann::json report_from(const ReportInput& input);

// Formats a report for people.
std::string table_of(const nlohmann::json& report);

// Frames composited by all processes of the slowest render_node; 0 if there is none.
std::uint64_t frames_composited(const StatusRegistry& statuses);

}  // namespace fivepipe::launch
