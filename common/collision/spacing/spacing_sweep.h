// At which spacings a movable part is free of the visual hull of one frame set, and at which it
// collides, certified over whole intervals of spacing and not only at samples.
//
//      part            hull      An interval is free if the volume that the part sweeps in it has
//     +----+  axis     .--.      no hull point: cubes around the swept triangles are certified by
//     |    | ------>  ( o  )     one camera each (CubeQuery). It collides if a point of the part's
//     +----+           '--'      surface stays in a ball that is in the hull
//     |----free----|??|--colliding--|    (HullQuery::solid_radius_m). The rest is bisected.
//
// One search decides a frame for any number of layouts: a layout asks only in which interval its
// spacing is. Freedom is not monotone in the spacing, because an arm may be behind the part.
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

// Each list is ascending, and its intervals are disjoint. Spacings in neither are undecided.
struct SpacingVerdicts {
  // At each spacing of the interval, no point of the part's surface is in the hull.
  std::vector<SpacingInterval> free;
  // At each spacing of the interval, a point of the part's surface is the centre of a ball in the
  // hull with a radius of SpacingOptions::solid_m.
  std::vector<SpacingInterval> colliding;
};

enum class SpacingVerdict { free, undecided, colliding };
// Returns the verdict on one spacing.
SpacingVerdict verdict_at(const SpacingVerdicts& verdicts, double spacing_m);

struct SpacingOptions {
  // An interval that is not longer is not divided, and stays undecided if it cannot be certified;
  // finite, > 0 [m].
  double tolerance_m = 0.1e-3;
  // Finite, >= 0. A detector with eps_m at most half of this finds each certified collision.
  double solid_m = 1e-3;
};

class SpacingSweep {
 public:
  // Borrows the query and its hull, which must outlive this object. Throws std::invalid_argument if
  // an option is out of range.
  SpacingSweep(const hull::HullQuery& query, const SpacingOptions& options);

  // Throws std::invalid_argument if the range is not finite or descends. Several threads may call
  // it at once.
  SpacingVerdicts operator()(const MovablePart& part, const SpacingInterval& range) const;

 private:
  class Search;
  const hull::HullQuery* query_;
  SpacingOptions options_;
};

}  // namespace fivepipe::collision
