// A virtual object that real ones warm: one number a vertex, driven by how near the visual hull is
// (the paper's distance-field primitives).
#pragma once
#include <span>
#include <vector>

#include "common/collision/proximity/proximity.h"
#include "common/config/collision_requests.h"

namespace fivepipe::sim {

// Each vertex goes to 1 - distance / cap, and to no less than 0, as 1 - exp(-t / heating_s) goes;
// where that is less than it has, cooling_s. The distance is the middle of its bounds: within half
// the tolerance.
class Warmth {
 public:
  Warmth(const config::Warming& warming, std::size_t vertices)
      : warming_(warming), warmth_(vertices, 0.0f) {}

  // By vertex; where nothing is known of a distance, the vertex keeps its warmth. elapsed_s >= 0.
  void follow(double elapsed_s, std::span<const collision::Proximity> vertices);
  void reset();
  const std::vector<float>& vertices() const { return warmth_; }  // 0 .. 1

 private:
  config::Warming warming_;
  std::vector<float> warmth_;
};

}  // namespace fivepipe::sim
