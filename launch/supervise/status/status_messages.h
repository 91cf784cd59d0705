// Converts NodeStatus messages.
#pragma once
#include <set>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/status/node_status.h"

namespace fivepipe::launch {

// A peer can send lists of any length: this many entries of each are used.
inline constexpr std::size_t kMaxStatusEntries = 256;

// `process` wrote the message; nullopt: it states no identity.
ProcessStatus status_from(const fivepipe_v1_NodeStatus& message,
                          std::optional<bus::ProcessId> process);

// The clock of arrival stamps [ns]; steady.
std::int64_t arrival_clock_ns();

// Adds all statuses that have arrived to the registry. If `nodes` is not empty, adds only the
// statuses of these nodes.
void take_statuses(bus::Reader<bus::topics::NodeStatus>& reader, StatusRegistry& registry,
                   const std::set<std::string>& nodes = {});

}  // namespace fivepipe::launch
