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
  bool known = true;  // false if the reference did not test it (large scenes)
  bool crosses_border() const { return crosses && leaves; }
};
using Truth = std::vector<std::vector<TriangleTruth>>;  // by object and triangle

// Tests at most max_tests seeded triangles with the exact reference (triangle_reference.h), apart
// from those in a single ball that HullDistance::clear_m() finds free. A triangle that touches the
// hull without a point deeper than rounding does not cross it.
Truth exact_truth(const CollisionScene& scene, std::size_t max_tests, base::WorkerPool& pool);

struct TruthCounts {
  std::size_t triangles = 0, known = 0, crossing = 0, crossing_border = 0, near = 0;
};
TruthCounts counts_of(const Truth& truth);

// The wrong verdicts of a method on known triangles.
struct VerdictErrors {
  std::size_t missed = 0;  // the triangle crosses the hull, and the method calls it free
  // The missed triangles that lie wholly in the hull, which methods that intersect surfaces cannot
  // find.
  std::size_t missed_inside = 0;
  // The deepest point of all missed triangles, and of those that cross the border.
  double deepest_missed_m = 0, deepest_missed_border_m = 0;
  // The method calls the triangle colliding, the reference does not, and none of the method's
  // points on it is in_hull().
  std::size_t invented = 0;
  std::size_t undecided = 0;  // the method calls the triangle neither free nor colliding
};
VerdictErrors wrong_of(const std::vector<collision::ObjectCollision>& found, const Truth& truth,
                       const CollisionScene& scene);

}  // namespace fivepipe::collision_bench
