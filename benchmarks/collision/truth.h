// What is true of each triangle of a scene, to hold methods against.
#pragma once
#include <vector>

#include "benchmarks/collision/scenes.h"
#include "common/base/worker_pool.h"
#include "common/collision/detection/detection.h"

namespace fivepipe::collision_bench {

struct TriangleTruth {
  bool crosses = false;  // some of it is in the hull
  bool leaves = true;    // some of it is not
  double deepest_m = 0;  // of its points in the hull, the depth of the deepest: a lower bound, 10
                         // um and 1 % below at most
  bool near = false;  // some of it is in the hull or nearer to it than kNear_m, by a bound that may
                      // say so of a triangle farther off
  bool known = true;  // false: not asked (large scenes)
  bool crosses_border() const { return crosses && leaves; }
};
using Truth = std::vector<std::vector<TriangleTruth>>;  // by object, triangle

// By the exact reference (triangle_reference.h); triangles that one ball certifies free need none.
// Of the others `most` are asked, drawn by seed. What merely touches the hull, without a point
// deeper than rounding, does not cross.
Truth exact_truth(const CollisionScene& scene, std::size_t most, base::WorkerPool& pool);

struct TruthCounts {
  std::size_t triangles = 0, known = 0, crossing = 0, crossing_border = 0, near = 0;
};
TruthCounts counts_of(const Truth& truth);

// What a method said wrongly. Of known triangles.
struct VerdictErrors {
  std::size_t missed = 0;  // crosses, and the method says free
  std::size_t missed_inside =
      0;  // of those, wholly in the hull: what surfaces against surfaces can't find
  double deepest_missed_m = 0,
         deepest_missed_border_m = 0;  // of all those; of those that cross the border
  std::size_t invented =
      0;  // the method says colliding, truth says no, and none of its points there is in_hull().
  std::size_t undecided = 0;  // neither said
};
VerdictErrors wrong_of(const std::vector<collision::ObjectCollision>& said, const Truth& truth,
                       const CollisionScene& scene);

}  // namespace fivepipe::collision_bench
