// NodeStatus from the wire.
#pragma once
#include <set>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/node_status.h"

namespace fivepipe::launch {

ProcessStatus status_from(const fivepipe_v1_NodeStatus& message, std::uint64_t writer);

// Everything that has arrived, into the book; of these nodes alone, unless `nodes` is empty.
void take_statuses(bus::Reader<bus::topics::NodeStatus>& reader, StatusBook& book,
                   const std::set<std::string>& nodes = {});

}  // namespace fivepipe::launch
