// The real objects that synthetic cameras see: a right hand with its arm. It holds a pipe, 14 cm
// long and 4 cm thick as in the paper's payload task, and moves over a table top at z = 0. The
// person stands at y = -0.6 m and looks along +y.
#pragma once
#include <vector>

#include "common/config/capture_config.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::capture {

enum class Material { skin, sleeve, pipe };

struct SyntheticPart {
  hull::Capsule capsule;
  Material material;
};

// Returns the parts at time t_s, in the world frame: always the same number in the same order.
// Periodic in t_s with world.period_s. The seed changes the fingers' phase, not the hand's path.
std::vector<SyntheticPart> synthetic_parts(const config::SyntheticWorld& world, double t_s);

}  // namespace fivepipe::capture
