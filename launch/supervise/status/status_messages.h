// Converts the messages NodeStatus and SimulationMetrics.
#pragma once
#include <set>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/status/node_status.h"
#include "launch/supervise/status/simulation_status.h"

namespace fivepipe::launch {

// Uses kMaxStatusEntries entries of each list. `process` wrote the message; nullopt: it states no
// identity.
ProcessStatus status_from(const fivepipe_v1_NodeStatus& message,
                          std::optional<bus::ProcessId> process);

// The clock of arrival stamps [ns]; steady.
std::int64_t arrival_clock_ns();

// Adds all statuses that have arrived to the registry. If `nodes` is not empty, adds only the
// statuses of these nodes. The registry counts a status as ignored whose process starts before 1970
// or after 2200. A process may start in the future: its clock has been set back, or is that of
// another host.
void take_statuses(bus::Reader<bus::topics::NodeStatus>& reader, StatusRegistry& registry,
                   const std::set<std::string>& nodes = {});

// Returns nullopt if a value is impossible: an energy that is not finite, a negative kinetic energy
// or depth, or a frame number or stamp beyond its limit.
std::optional<SimulationStatus> simulation_from(const fivepipe_v1_SimulationMetrics& message);

// Adds all metrics that have arrived to the registry. If `nodes` is not empty, adds only those of
// these nodes. The registry counts a message with an impossible value as ignored.
void take_metrics(bus::Reader<bus::topics::SimulationMetrics>& reader, SimulationRegistry& registry,
                  const std::set<std::string>& nodes = {});

}  // namespace fivepipe::launch
