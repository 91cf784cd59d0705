// How `fivepipe up` starts and watches the nodes of this host and the recorder.
#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "launch/supervise/deployment_run.h"
#include "launch/supervise/supervisor.h"

namespace fivepipe::launch {

// spacings: returns the spacings [m], by object, with which sim_node begins. Called at each start.
std::vector<Program> programs_of(const std::vector<config::Node>& nodes,
                                 const RunSettings& settings,
                                 std::function<std::map<std::string, double>()> spacings);
// The arguments of `fivepipe record` for RunSettings::record.
std::vector<std::string> recorder_arguments(const RunSettings& settings);
// nullopt: stalled nodes are not noticed.
std::optional<WatchdogSettings> watchdog_of(const RunSettings& settings);

}  // namespace fivepipe::launch
