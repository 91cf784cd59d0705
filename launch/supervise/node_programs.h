// How `fivepipe up` starts and watches the nodes of this host.
#pragma once
#include <optional>
#include <vector>

#include "common/config/deployment.h"
#include "launch/supervise/deployment_run.h"
#include "launch/supervise/supervisor.h"

namespace fivepipe::launch {

std::vector<Program> programs_of(const std::vector<config::Node>& nodes,
                                 const RunSettings& settings);
// nullopt: stalled nodes are not noticed.
std::optional<WatchdogSettings> watchdog_of(const RunSettings& settings);

}  // namespace fivepipe::launch
