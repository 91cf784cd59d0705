// NodeStatus from the wire.
#pragma once
#include <set>

#include "common/bus/bus.h"
#include "launch/node_status.h"

namespace fivepipe {

ProcessStatus status_from(const fivepipe_v1_NodeStatus& message, std::uint64_t writer);

// Everything that has arrived, into the book; of these nodes alone, unless `nodes` is empty.
void take_statuses(Reader<topics::NodeStatus>& reader, StatusBook& book, const std::set<std::string>& nodes = {});

}  // namespace fivepipe
