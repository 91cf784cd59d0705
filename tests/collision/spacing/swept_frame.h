// A frame and a movable part in it, for the tests of spacings.
#pragma once
#include <memory>

#include "common/collision/detection/cpu/cpu_detector.h"
#include "common/collision/spacing/spacing_sweep.h"
#include "tests/support/collision/scene.h"
#include "tests/support/hull/test_pool.h"

namespace fivepipe::test {

// One frame: its hull, the sweep, and a detector that decides single spacings.
struct SweptFrame {
  std::vector<hull::Silhouette> silhouettes;
  hull::CpuHull hull;
  hull::HullQuery query;
  std::unique_ptr<collision::CollisionDetector> detector =
      collision::cpu_detector({.eps_m = 0.5e-3, .spacing_m = 0});

  explicit SweptFrame(std::vector<hull::Silhouette> s)
      : silhouettes(std::move(s)), hull(test_pool(), silhouettes), query(hull) {
    detector->set_hull(query, silhouettes);
  }
  collision::SpacingVerdicts sweep(const collision::MovablePart& part,
                                   const collision::SpacingInterval& range,
                                   const collision::SpacingOptions& options = {}) const {
    return collision::SpacingSweep(query, options)(part, range);
  }
  bool collides(const collision::MovablePart& part, double spacing_m) {
    const std::vector<collision::DetectionObject> objects{{&part.tree(), part.pose(spacing_m)}};
    return detector->detect(objects)[0].colliding();
  }
};

inline double length_m(const std::vector<collision::SpacingInterval>& intervals) {
  double sum_m = 0;
  for (const collision::SpacingInterval& i : intervals) sum_m += i.high_m - i.low_m;
  return sum_m;
}

}  // namespace fivepipe::test
