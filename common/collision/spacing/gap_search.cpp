#include "common/collision/spacing/gap_search.h"

#include <algorithm>
#include <queue>
#include <vector>

#include "common/collision/proximity/moving_triangle.h"
#include "common/collision/proximity/proximity_shapes.h"
#include "common/collision/spacing/spacing_intervals.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

constexpr int kMaxDetections = 256;
// Points that are tested to find a larger ball than that about a collision point.
constexpr int kMaxSteps = 64;
// Distance of a point that was moved in a triangle's plane from it.
constexpr double kPlaneRounding_m = 1e-12;

struct Gap {
  SpacingInterval interval;
  bool low_touches, high_touches;  // whether the part touches the hull at that end
  double width_m() const { return interval.high_m - interval.low_m; }
  int touching_ends() const { return low_touches + high_touches; }
  // Between two collisions, the shortest gap may be free, so it matters for a penetration.
  bool is_narrow() const {
    return width_m() <= (touching_ends() == 2 ? kNarrowestGap_m : kNarrowGap_m);
  }
  // Those that split a collision, then those at its ends, each the widest first.
  bool operator<(const Gap& other) const {
    return std::pair(touching_ends(), width_m()) <
           std::pair(other.touching_ends(), other.width_m());
  }
};

// Moves the point in its triangle to where a larger ball about it is in the hull, by steps along
// the triangle's plane, and returns the radius. A collision point is anywhere in the hull, often
// near its border.
double deepened_m(const hull::HullQuery& query, const Triangle& triangle, Vector3d p_m,
                  double step_m) {
  const Vector3d along = (triangle[1] - triangle[0]).stableNormalized(),
                 normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]),
                 across = normal.cross(along).stableNormalized();
  const TriangleShape shape(triangle);
  double radius_m = query.solid_radius_m(p_m);
  for (int tests = 0; tests < kMaxSteps && step_m > radius_m / 8; step_m /= 2)
    for (bool has_moved = true; has_moved && tests < kMaxSteps;) {
      has_moved = false;
      for (const Vector3d& direction : {along, Vector3d(-along), across, Vector3d(-across)}) {
        const Vector3d tried_m = shape.nearest_to(p_m + step_m * direction);
        const double tried_radius_m = query.solid_radius_m(tried_m);
        ++tests;
        if (tried_radius_m > radius_m) p_m = tried_m, radius_m = tried_radius_m, has_moved = true;
      }
    }
  return radius_m;
}

// Returns the radius of a ball in the hull about a point of the part's surface at this spacing: at
// most about enough_m; 0 if none is found.
double solid_radius_m(const ObjectCollision& found, const MovablePart& part, double spacing_m,
                      double enough_m, const hull::HullQuery& query) {
  double radius_m = 0;
  const CollisionPoint* deepest = nullptr;
  for (const CollisionPoint& point : found.points)
    if (const double of_point_m = query.solid_radius_m(point.p_world_m);
        !deepest || of_point_m > radius_m)
      deepest = &point, radius_m = of_point_m;
  if (deepest && radius_m < enough_m) {
    Triangle triangle =
        corners(part.tree().mesh().triangles[deepest->triangle], part.tree().mesh().vertices_m);
    for (Vector3d& corner_m : triangle) corner_m += part.move_world_m(spacing_m);
    radius_m = deepened_m(query, triangle, deepest->p_world_m, enough_m);
  }
  return std::max(0.0, kBelowOne * radius_m - kPlaneRounding_m);
}

// Those that are wider than they need to be.
std::vector<Gap> gaps_of(const SpacingVerdicts& verdicts, const SpacingInterval& range) {
  std::vector<Gap> gaps;
  Gap gap{{range.low_m, range.low_m}, false, false};
  const auto end_at = [&](double high_m, bool touches) {
    gap.interval.high_m = high_m;
    gap.high_touches = touches;
    if (gap.width_m() > 0 && !gap.is_narrow()) gaps.push_back(gap);
  };
  auto free = verdicts.free.begin();
  auto touching = verdicts.touching.begin();
  while (free != verdicts.free.end() || touching != verdicts.touching.end()) {
    const bool touches = free == verdicts.free.end() ||
                         (touching != verdicts.touching.end() && touching->low_m < free->low_m);
    const SpacingInterval known = touches ? *touching++ : *free++;
    end_at(known.low_m, touches);
    gap = {{known.high_m, known.high_m}, touches, false};
  }
  end_at(range.high_m, false);
  return gaps;
}

}  // namespace

void narrow_gaps(SpacingVerdicts& verdicts, const MovablePart& part, const SpacingInterval& range,
                 const hull::HullQuery& query, CollisionDetector& detector) {
  std::priority_queue<Gap> gaps;
  for (const Gap& gap : gaps_of(verdicts, range)) gaps.push(gap);
  for (int detections = 0; detections < kMaxDetections && !gaps.empty(); ++detections) {
    const Gap gap = gaps.top();
    gaps.pop();
    const auto [low_m, high_m] = gap.interval;
    const double mid_m = low_m / 2 + high_m / 2;
    const DetectionObject object{&part.tree(), part.pose(mid_m)};
    const ObjectCollision& found = detector.detect({&object, 1})[0];
    const double radius_m = solid_radius_m(found, part, mid_m, gap.width_m(), query);
    const SpacingInterval touching{std::max(low_m, mid_m - radius_m),
                                   std::min(high_m, mid_m + radius_m)};
    if (radius_m > 0) add(verdicts.touching, touching);
    for (const Gap& rest : {Gap{{low_m, touching.low_m}, gap.low_touches, found.colliding()},
                            Gap{{touching.high_m, high_m}, found.colliding(), gap.high_touches}})
      if (!rest.is_narrow()) gaps.push(rest);
  }
}

}  // namespace fivepipe::collision
