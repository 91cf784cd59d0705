#include "common/study/part_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/collision/spacing/gap_search.h"

namespace fivepipe::study {
namespace {

using collision::SpacingInterval;
using collision::SpacingVerdicts;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
// Most collisions are less deep, so that this is searched first.
constexpr double kNear_m = 0.03;
constexpr double kDetected_m = 0.2e-3;

// To the ends of the interval in which the part touches the hull throughout.
double least_depth_m(const SpacingVerdicts& verdicts, const SpacingInterval& permitted,
                     double spacing_m) {
  for (const SpacingInterval& i : verdicts.touching) {
    if (spacing_m < i.low_m || spacing_m > i.high_m) continue;
    return std::min(i.low_m > permitted.low_m ? spacing_m - i.low_m : kUnlimited,
                    i.high_m < permitted.high_m ? i.high_m - spacing_m : kUnlimited);
  }
  return 0;
}

double nearest_free_m(const SpacingVerdicts& verdicts, double spacing_m) {
  double nearest_m = kUnlimited;
  for (const SpacingInterval& i : verdicts.free)
    nearest_m = std::min(nearest_m, std::max({0.0, i.low_m - spacing_m, spacing_m - i.high_m}));
  return nearest_m;
}

// Distance to a spacing between this one and `end_m` at which the detector finds the part free:
// where a face of the part and the hull's border are parallel, a sweep reaches its limit.
double detected_free_m(const collision::MovablePart& part, FrameHull& hull, double spacing_m,
                       double end_m) {
  const auto is_free = [&](double at_m) {
    const collision::DetectionObject object{&part.tree(), part.pose(at_m)};
    return hull.detector->detect({&object, 1})[0].verdict == collision::CollisionVerdict::free;
  };
  if (!is_free(end_m)) return kUnlimited;
  double colliding_m = spacing_m, free_m = end_m;
  while (std::abs(free_m - colliding_m) > kDetected_m) {
    const double mid_m = 0.5 * (colliding_m + free_m);
    (is_free(mid_m) ? free_m : colliding_m) = mid_m;
  }
  return std::abs(free_m - spacing_m);
}

}  // namespace

PartDepth::PartDepth(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_part,
                     const Eigen::Vector3d& axis_world, const SpacingInterval& range) {
  if (!(range.low_m <= range.high_m && std::abs(range.low_m) <= collision::kMaxSpacing_m &&
        std::abs(range.high_m) <= collision::kMaxSpacing_m))
    throw std::invalid_argument("depth of a part: a range must ascend and be within 1 km");
  lines_.push_back({{mesh, world_from_part, axis_world}, range, range});
}

PartDepth::PartDepth(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_part) {
  for (const int axis : {0, 1, 2})
    lines_.push_back({{mesh, world_from_part, Eigen::Vector3d::Unit(axis)},
                      {-kMaxMove_m, kMaxMove_m},
                      {-kUnlimited, kUnlimited}});
}

Bracket PartDepth::operator()(FrameHull& hull, double spacing_m) const {
  Bracket least{kUnlimited, kUnlimited};
  for (const Line& line : lines_) {
    const Bracket found = along(line, hull, spacing_m, least.max_m);
    least = {std::min(least.min_m, found.min_m), std::min(least.max_m, found.max_m)};
  }
  return least;
}

// Moves by more than at_most_m are not searched.
Bracket PartDepth::along(const Line& line, FrameHull& hull, double spacing_m, double at_most_m) {
  const SpacingInterval range{std::min(line.searched.low_m, spacing_m),
                              std::max(line.searched.high_m, spacing_m)};
  const collision::SpacingSweep sweep(*hull.query, {.solid_m = 2 * hull.eps_m});
  for (const double reach_m : {std::min(kNear_m, at_most_m), at_most_m}) {
    const SpacingInterval tried{std::max(range.low_m, spacing_m - reach_m),
                                std::min(range.high_m, spacing_m + reach_m)};
    SpacingVerdicts verdicts = sweep(line.part, tried);
    collision::narrow_gaps(verdicts, line.part, tried, *hull.query, *hull.detector);
    Bracket found{least_depth_m(verdicts, line.permitted, spacing_m),
                  nearest_free_m(verdicts, spacing_m)};
    if (!verdicts.is_complete)
      for (const double end_m : {std::max(tried.low_m, spacing_m - found.max_m),
                                 std::min(tried.high_m, spacing_m + found.max_m)})
        found.max_m = std::min(found.max_m, detected_free_m(line.part, hull, spacing_m, end_m));
    if (std::isfinite(found.max_m) || reach_m == at_most_m || tried == range) return found;
  }
  return {0, kUnlimited};
}

}  // namespace fivepipe::study
