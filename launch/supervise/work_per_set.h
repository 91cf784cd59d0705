// What one frame set costs the processor, and what limits the rate of the sets. Pure.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "launch/supervise/report.h"

namespace fivepipe::launch {

// Returns the CPU time of each part of the pipeline per composited set [ms], over all processes and
// their threads, since the first frame of each process. `decoding`: reading images, with decoding
// and conversion to BGR; also what capture_node does beside its other two parts. null if fewer than
// kMinSets sets were composited.
nlohmann::json core_ms_per_set(const ReportInput& input, std::uint64_t composited);
inline constexpr std::uint64_t kMinSets = 10;

// Names what limits the rate of composited sets, for the user: the requested rate, the processor
// (with the largest part), or waiting (with the node that uses most cores: with one busy thread it
// uses one, and the others wait for it). Empty if that is unknown, because of too few sets or nodes
// on other hosts.
std::string what_bounds_the_rate(const ReportInput& input, const nlohmann::json& core_ms_per_set,
                                 std::uint64_t composited, double frame_rate_hz);

}  // namespace fivepipe::launch
