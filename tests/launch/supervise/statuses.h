// Statuses of made-up nodes.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "common/pipeline/bus/process_id.h"
#include "launch/supervise/status/node_status.h"
#include "tests/support/time_units.h"

namespace fivepipe::test {

inline const bus::ProcessId kFirst{"alpha", 12, 1}, kSecond{"alpha", 34, 2};

inline launch::ProcessStatus status(const std::string& node, std::optional<bus::ProcessId> process,
                                    std::int64_t start_stamp_ns) {
  launch::ProcessStatus status;
  status.node = node;
  status.process = std::move(process);
  status.start_stamp_ns = start_stamp_ns;
  return status;
}

// Of process `pid` on host alpha.
inline launch::ProcessStatus status(const std::string& node, std::uint32_t pid,
                                    std::int64_t start_stamp_ns = 1 * s) {
  return status(node, bus::ProcessId{"alpha", pid, 1}, start_stamp_ns);
}

}  // namespace fivepipe::test
