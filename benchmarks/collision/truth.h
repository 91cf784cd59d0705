// The true relation of each triangle of a scene to the hull, which methods are compared with.
#pragma once
#include <vector>

#include "benchmarks/collision/scenes.h"
#include "common/base/worker_pool.h"
#include "common/collision/detection/detection.h"

namespace fivepipe::collision_bench {

struct TriangleTruth {
  bool crosses = false;  // a part of it is in the hull
  bool leaves = true;    // a part of it is outside
  // The depth below the hull's border of its deepest point: a lower bound, at most 10 um and 1 %
  // below the true depth.
  double deepest_m = 0;
  // A part of it is in the hull or nearer to it than kNear_m. The bound is conservative: it may
  // include triangles that are farther away.
  bool near = false;
  bool crosses_border() const { return crosses && leaves; }
};
using Truth = std::vector<std::vector<TriangleTruth>>;  // by object and triangle

// Determines every triangle of the scene by the exact references alone: triangle_reference.h, and
// distance_reference.h for triangles whose ball is farther from the hull than its radius. A
// triangle that touches the hull without a point deeper than rounding does not cross it.
Truth exact_truth(const CollisionScene& scene, base::WorkerPool& pool);

struct TruthCounts {
  std::size_t triangles = 0, crossing = 0, crossing_border = 0, near = 0;
};
TruthCounts counts_of(const Truth& truth);

// The wrong verdicts of a method, by the truth alone.
struct VerdictErrors {
  std::size_t missed = 0;         // the triangle crosses the hull, and the method calls it free
  std::size_t missed_inside = 0;  // of those, the triangles that are wholly in the hull
  // The deepest point of all missed triangles, and of those that cross the border.
  double deepest_missed_m = 0, deepest_missed_border_m = 0;
  std::size_t invented = 0;   // the triangle does not cross, and the method calls it colliding
  std::size_t undecided = 0;  // the method calls the triangle neither free nor colliding
};
VerdictErrors wrong_of(const std::vector<collision::ObjectCollision>& found, const Truth& truth);

}  // namespace fivepipe::collision_bench
