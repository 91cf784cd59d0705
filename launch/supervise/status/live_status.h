// Texts about running nodes, from their statuses. Pure.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "launch/supervise/status/node_status.h"

namespace fivepipe::launch {

// The rendering has stopped if no frame is composited for longer than this [s]: three frame
// periods, and at least the 2 s that a node may take for a frame once in a while.
double max_frame_gap_s(double frame_rate_hz);

// The names of hosts, by node.
using HostsOfNodes = std::map<std::string, std::string>;

struct Progress {
  double elapsed_s = 0;                   // since the start of `fivepipe up`
  double frame_rate_hz = 30;              // of the deployment
  std::vector<std::string> render_nodes;  // empty: the deployment composites no frames
  std::uint64_t composited = 0;
  std::optional<double> newest_frame_age_s;     // nullopt: no frame is composited yet
  std::vector<std::string> missing_hosts = {};  // texts; their nodes are not `expected`
  // Nodes whose statuses should arrive.
  std::vector<std::string> expected;
  // Those of them that run on another host; an empty name: one of the deployment's other hosts.
  HostsOfNodes other_hosts = {};
};

// The line that `fivepipe up` prints: "12 s: 240 frames composited, now 19.8 frames/s" or
// "no frame for 4 s", then the nodes without a recent status. One of another host is out of reach:
// only that host can know whether it hangs. The rate is that of the slowest render_node. `now_ns`
// is of the clock of the registry's arrival stamps.
std::string progress_line(const Progress& progress, const StatusRegistry& registry,
                          std::int64_t now_ns);

// The table and the messages of `fivepipe top`. A silent node has no rates. deployed: the nodes
// of the deployment file, if there is one; an empty host is the machine of the process. Those of
// them that have sent no status come first.
std::string nodes_table(const StatusRegistry& registry, std::int64_t now_ns,
                        const HostsOfNodes& deployed = {});
std::string node_messages(const StatusRegistry& registry);

// "2 processes publish as node 'sim': process 12 on host alpha, process 34 on host beta".
std::string text_of(const DuplicateNode& duplicate);

}  // namespace fivepipe::launch
