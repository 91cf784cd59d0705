// Converts NodeStatus messages.
#pragma once
#include <set>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/node_status.h"

namespace fivepipe::launch {

// `writer` is the publication handle of the message's writer.
ProcessStatus status_from(const fivepipe_v1_NodeStatus& message, std::uint64_t writer);

// Adds all statuses that have arrived to the registry. If `nodes` is not empty, adds only the
// statuses of these nodes.
void take_statuses(bus::Reader<bus::topics::NodeStatus>& reader, StatusRegistry& registry,
                   const std::set<std::string>& nodes = {});

}  // namespace fivepipe::launch
