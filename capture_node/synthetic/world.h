// The real things that synthetic cameras see: a right hand with its arm, holding a pipe 14 cm long
// and 4 cm thick as in the paper's payload task, moving over a table top at z = 0. The person
// stands at y = -0.6 m and looks along +y.
#pragma once
#include <vector>

#include "common/config/deployment.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::capture {

enum class Material { skin, sleeve, pipe };

struct SyntheticPart {
  hull::Capsule capsule;
  Material material;
};

// Always the same number of parts in the same order. Periodic in t_s with world.period_s; the seed
// shifts how the fingers move, never where the hand is.
std::vector<SyntheticPart> synthetic_parts(const config::SyntheticWorld& world, double t_s);
std::vector<hull::Capsule> synthetic_object(const config::SyntheticWorld& world, double t_s);

}  // namespace fivepipe::capture
