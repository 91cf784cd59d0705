#include "sim_node/proximity/warmth.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe::sim {
namespace {

bool is_unknown(const collision::Proximity& p) { return p.min_m == 0 && std::isinf(p.max_m); }

}  // namespace

void Warmth::advance(double elapsed_s, std::span<const collision::Proximity> vertices) {
  assert(vertices.size() == warmth_.size() && elapsed_s >= 0);
  const float heated = float(1 - std::exp(-elapsed_s / warming_.heating_s)),
              cooled = float(1 - std::exp(-elapsed_s / warming_.cooling_s));
  for (std::size_t i = 0; i < warmth_.size(); ++i) {
    if (is_unknown(vertices[i])) continue;
    // Infinite at and beyond the cap.
    const double distance_m = 0.5 * (vertices[i].min_m + vertices[i].max_m);
    const float goal = float(std::max(0.0, 1 - distance_m / warming_.cap_m));
    warmth_[i] += (goal > warmth_[i] ? heated : cooled) * (goal - warmth_[i]);
  }
}

void Warmth::reset() { std::fill(warmth_.begin(), warmth_.end(), 0.0f); }

}  // namespace fivepipe::sim
