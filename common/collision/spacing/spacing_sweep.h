// At which spacings a movable part is free of the visual hull of one frame set, and at which it
// collides, certified over whole intervals of spacing and not only at samples.
//
//      part            hull      An interval is free if the volume that the part sweeps in it has
//     +----+  axis     .--.      no hull point: what its boxes and triangles sweep is certified by
//     |    | ------>  ( o  )     one camera each (CubeQuery). It collides if a point of the part's
//     +----+           '--'      surface stays in a ball that is in the hull
//     |----free----|??|--colliding--|    (HullQuery::solid_radius_m). The rest is bisected, the
//                                        longest intervals first.
//
// One search decides a frame for any number of layouts: the verdict on a layout is that of the
// interval with its spacing. Freedom is not monotone in the spacing, because an arm may be behind
// the part.
//
// Verdicts are on the part's surface, as those of CollisionDetector: a part of the hull that is
// wholly inside a closed part does not collide.
#pragma once
#include <span>
#include <vector>

#include "common/collision/spacing/movable_part.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// A closed interval [m].
struct SpacingInterval {
  double low_m, high_m;
  bool operator==(const SpacingInterval&) const = default;
};

// Each list is ascending, and its intervals are disjoint. Spacings that are neither free nor
// colliding are undecided.
struct SpacingVerdicts {
  // At each spacing of the interval, no point of the part's surface is in the hull.
  std::vector<SpacingInterval> free;
  // At each spacing of the interval, a point of the part's surface is in the hull.
  std::vector<SpacingInterval> touching;
  // Also the centre of a ball in the hull with a radius of SpacingOptions::solid_m. Each of these
  // intervals is in one of `touching`.
  std::vector<SpacingInterval> colliding;
  // False if the search reached its limit of tests. It then leaves more undecided: the shortest
  // intervals, beside contact. A part that slides along the hull at a distance of a fraction of a
  // millimetre may reach the limit.
  bool is_complete = true;
};

// Largest spacing of a range, and smallest [m]: beyond, the rounding of coordinates would exceed
// the tolerance.
inline constexpr double kMaxSpacing_m = 1000;

enum class SpacingVerdict { free, undecided, colliding };
// Returns the verdict on one spacing.
SpacingVerdict verdict_at(const SpacingVerdicts& verdicts, double spacing_m);

struct SpacingOptions {
  // An interval that is not longer is not divided, and stays undecided if it cannot be certified;
  // finite, > 0 [m].
  double tolerance_m = 0.1e-3;
  // Finite, >= 0. A detector with eps_m at most half of this finds each certified collision, except
  // in triangles that exceed its budget (CpuDetectionCounts::over_budget).
  double solid_m = 1e-3;
};

class SpacingSweep {
 public:
  // Borrows the query and its hull, which must outlive this object. Throws std::invalid_argument if
  // an option is out of range.
  SpacingSweep(const hull::HullQuery& query, const SpacingOptions& options);

  // Throws std::invalid_argument if the range exceeds kMaxSpacing_m or descends. Several threads
  // may call it at once.
  SpacingVerdicts operator()(const MovablePart& part, const SpacingInterval& range) const;

 private:
  class Search;
  const hull::HullQuery* query_;
  SpacingOptions options_;
};

}  // namespace fivepipe::collision
