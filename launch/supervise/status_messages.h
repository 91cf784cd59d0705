// NodeStatus from the wire.
#pragma once
#include <set>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/node_status.h"

namespace fivepipe::launch {

ProcessStatus status_from(const fivepipe_v1_NodeStatus& message, std::uint64_t writer);

// Everything that has arrived, into the registry; of these nodes alone, unless `nodes` is empty.
void take_statuses(bus::Reader<bus::topics::NodeStatus>& reader, StatusRegistry& registry,
                   const std::set<std::string>& nodes = {});

}  // namespace fivepipe::launch
