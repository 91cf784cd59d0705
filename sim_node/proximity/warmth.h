// Warmth of a virtual object: one value per vertex that follows the distance to the visual hull
// (the paper's distance-field primitives).
#pragma once
#include <span>
#include <vector>

#include "common/collision/proximity/proximity.h"
#include "common/config/collision_requests.h"

namespace fivepipe::sim {

// The warmth of a vertex approaches 1 - distance / cap, at least 0, exponentially: with time
// constant heating_s if it rises, cooling_s if it falls. The distance is the centre of its bounds,
// accurate to half the tolerance.
class Warmth {
 public:
  Warmth(const config::Warming& warming, std::size_t vertices)
      : warming_(warming), warmth_(vertices, 0.0f) {}

  // Advances by elapsed_s >= 0 towards the given distances, one per vertex. A vertex of unknown
  // distance keeps its warmth.
  void advance(double elapsed_s, std::span<const collision::Proximity> vertices);
  void reset();
  const std::vector<float>& vertices() const { return warmth_; }  // 0 .. 1

 private:
  config::Warming warming_;
  std::vector<float> warmth_;
};

}  // namespace fivepipe::sim
