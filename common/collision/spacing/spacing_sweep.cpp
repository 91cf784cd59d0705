#include "common/collision/spacing/spacing_sweep.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "common/collision/proximity/lazy_octree.h"
#include "common/collision/proximity/moving_triangle.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Relative rounding error of a box's centre and size, per sum of their sizes.
constexpr double kBoxRounding = 32 * std::numeric_limits<double>::epsilon();
// Covers the rounding of a ball's radius and of the interval in which its centre stays in it.
constexpr double kBelowOne = 1 - 1e-9;
// Points of the part's surface that are tried as centres of a ball in the hull, per spacing, and
// the largest half size of the parts of triangles that they are the centroids of [m].
constexpr int kMaxCenters = 96;
constexpr double kCenterSpacing_m = 4e-3;

struct Box {
  Vector3d center_m, half_m;
};
// A box of the tree, at spacing 0.
struct Node {
  int level, index;
  Box box;
};
// A part of a triangle, at spacing 0.
struct Part {
  Triangle triangle;
  Box box;
};

Part part_of(const Triangle& t) {
  const Vector3d low = t[0].cwiseMin(t[1]).cwiseMin(t[2]),
                 high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
  return {t, {low / 2 + high / 2, high / 2 - low / 2}};
}

Vector3d centroid(const Triangle& t) { return (t[0] + t[1] + t[2]) / 3; }

void push_quarters(const Triangle& t, std::vector<Part>& parts) {
  const auto& [a, b, c] = t;
  const Vector3d ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
  for (const Triangle& quarter : {Triangle{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
    parts.push_back(part_of(quarter));
}

template <class T>
T taken(std::vector<T>& from) {
  const T last = from.back();
  from.pop_back();
  return last;
}

// Adds an interval to ascending, disjoint ones.
void add(std::vector<SpacingInterval>& intervals, SpacingInterval added) {
  const auto first = std::ranges::find_if(
      intervals, [&](const SpacingInterval& i) { return i.high_m >= added.low_m; });
  auto last = first;
  for (; last != intervals.end() && last->low_m <= added.high_m; ++last)
    added = {std::min(added.low_m, last->low_m), std::max(added.high_m, last->high_m)};
  intervals.insert(intervals.erase(first, last), added);
}

bool holds(std::span<const SpacingInterval> intervals, double spacing_m) {
  const auto after = std::ranges::upper_bound(intervals, spacing_m, {}, &SpacingInterval::low_m);
  return after != intervals.begin() && spacing_m <= std::prev(after)->high_m;
}

}  // namespace

SpacingVerdict verdict_at(const SpacingVerdicts& verdicts, double spacing_m) {
  if (holds(verdicts.free, spacing_m)) return SpacingVerdict::free;
  return holds(verdicts.colliding, spacing_m) ? SpacingVerdict::colliding
                                              : SpacingVerdict::undecided;
}

// The search for one part.
class SpacingSweep::Search {
 public:
  Search(const SpacingSweep& sweep, const MovablePart& part)
      : query_(*sweep.query_),
        options_(sweep.options_),
        cubes_(query_),
        tree_(part.tree()),
        axis_(part.axis_world()) {}

  SpacingVerdicts operator()(const SpacingInterval& range) {
    decide(range);
    // A ball may reach beyond the range.
    for (SpacingInterval& i : found_.colliding)
      i = {std::max(i.low_m, range.low_m), std::min(i.high_m, range.high_m)};
    return std::move(found_);
  }

 private:
  void decide(SpacingInterval range) {
    if (!trim(range)) return;
    if (is_free(range)) return add(found_.free, range);
    const double mid_m = range.low_m / 2 + range.high_m / 2, half_m = mid_m - range.low_m;
    const double radius_m =
        kBelowOne * ball_radius(mid_m, half_m + 2 * options_.solid_m) - options_.solid_m;
    if (radius_m > 0) add(found_.colliding, {mid_m - radius_m, mid_m + radius_m});
    if (range.high_m - range.low_m <= options_.tolerance_m || !(half_m > 0)) return;
    decide({range.low_m, mid_m});
    decide({mid_m, range.high_m});
  }

  // Removes what is known to collide from the ends of the range. Returns false if nothing is left.
  bool trim(SpacingInterval& range) const {
    for (const SpacingInterval& known : found_.colliding) {
      if (known.low_m <= range.low_m && known.high_m >= range.high_m) return false;
      if (known.low_m <= range.low_m && known.high_m > range.low_m) range.low_m = known.high_m;
      if (known.high_m >= range.high_m && known.low_m < range.high_m) range.high_m = known.low_m;
    }
    return true;
  }

  bool is_certified_free(const Box& box, double mid_m, double reach_m) const {
    const Vector3d center_m = box.center_m + mid_m * axis_,
                   half_m = box.half_m + reach_m * axis_.cwiseAbs();
    const double rounding_m =
        kBoxRounding * (box.center_m.cwiseAbs().sum() + std::abs(mid_m) + half_m.sum());
    return cubes_.test(center_m, half_m.maxCoeff() + rounding_m).free;
  }

  // Whether the volume that the part sweeps in the range is certified free. Divides triangles down
  // to the length of the range.
  bool is_free(const SpacingInterval& range) {
    const double mid_m = range.low_m / 2 + range.high_m / 2,
                 reach_m = std::max(mid_m - range.low_m, range.high_m - mid_m);
    return each_uncertain(mid_m, reach_m, std::max(reach_m, options_.tolerance_m / 2),
                          [](const Triangle&) { return false; });
  }

  // Returns the largest radius found, up to enough_m, of a ball in the hull about a point of the
  // part's surface.
  double ball_radius(double spacing_m, double enough_m) {
    double radius_m = 0;
    int left = kMaxCenters;
    each_uncertain(spacing_m, 0, kCenterSpacing_m, [&](const Triangle& t) {
      radius_m = std::max(radius_m, query_.solid_radius_m(centroid(t) + spacing_m * axis_));
      return radius_m < enough_m && --left > 0;
    });
    return std::min(radius_m, enough_m);
  }

  // Calls take() for each part of a triangle, of half sizes up to finest_m, whose sweep by reach_m
  // to both sides of mid_m is not certified free; stops and returns false if take() does.
  template <class Take>
  bool each_uncertain(double mid_m, double reach_m, double finest_m, const Take& take) {
    nodes_.clear();
    if (!tree_.empty()) push_nodes(tree_.levels() - 1, 0);
    while (!nodes_.empty()) {
      const Node node = taken(nodes_);
      if (is_certified_free(node.box, mid_m, reach_m)) continue;
      if (node.level > 0) {
        push_nodes(node.level - 1, node.index);
        continue;
      }
      parts_.clear();
      for (const std::uint32_t i : tree_.triangles_of(node.index))
        parts_.push_back(part_of(corners(tree_.mesh().triangles[i], tree_.mesh().vertices_m)));
      while (!parts_.empty()) {
        const Part part = taken(parts_);
        if (is_certified_free(part.box, mid_m, reach_m)) continue;
        if (part.box.half_m.maxCoeff() > finest_m)
          push_quarters(part.triangle, parts_);
        else if (!take(part.triangle))
          return false;
      }
    }
    return true;
  }

  void push_nodes(int level, int parent) {
    const Bvh::Boxes& boxes = tree_.boxes(level, parent);
    for (std::size_t i = 0; i < Bvh::kArity; ++i) {
      const Vector3d center_m(boxes.center_m[0][i], boxes.center_m[1][i], boxes.center_m[2][i]),
          half_m(boxes.half_m[0][i], boxes.half_m[1][i], boxes.half_m[2][i]);
      if (half_m.x() >= 0)
        nodes_.push_back(
            {level, parent * Bvh::kArity + int(i), {tree_.origin_m() + center_m, half_m}});
    }
  }

  const hull::HullQuery& query_;
  const SpacingOptions& options_;
  CubeQuery cubes_;
  const Bvh& tree_;
  Vector3d axis_;
  SpacingVerdicts found_;
  std::vector<Node> nodes_;  // still to test
  std::vector<Part> parts_;  // of the present node, still to test
};

SpacingSweep::SpacingSweep(const hull::HullQuery& query, const SpacingOptions& options)
    : query_(&query), options_(options) {
  if (!(std::isfinite(options.tolerance_m) && options.tolerance_m > 0 &&
        std::isfinite(options.solid_m) && options.solid_m >= 0))
    throw std::invalid_argument(
        "spacing: tolerance_m must be finite and positive, solid_m finite and not negative");
}

SpacingVerdicts SpacingSweep::operator()(const MovablePart& part,
                                         const SpacingInterval& range) const {
  if (!(std::isfinite(range.low_m) && std::isfinite(range.high_m) && range.low_m <= range.high_m))
    throw std::invalid_argument("spacing: the range must be finite and not descend");
  if (query_->hull().unusable()) return {};
  if (query_->hull().empty()) return {{range}, {}};
  return Search(*this, part)(range);
}

}  // namespace fivepipe::collision
