// The real objects that synthetic cameras see. A person sits at y = -0.75 m and looks along +y
// over a table top at z = 0; config::SyntheticActor names what the person does.
#pragma once
#include <vector>

#include "capture_node/synthetic/actors/part.h"
#include "common/config/capture/capture_config.h"

namespace fivepipe::capture {

// Returns the parts at time t_s, in the world frame: always the same number in the same order.
// Periodic in t_s with world.period_s.
std::vector<SyntheticPart> synthetic_parts(const config::SyntheticWorld& world, double t_s);

}  // namespace fivepipe::capture
