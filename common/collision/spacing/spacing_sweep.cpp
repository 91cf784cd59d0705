#include "common/collision/spacing/spacing_sweep.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <stdexcept>
#include <utility>
#include <variant>

#include "common/collision/proximity/lazy_octree.h"
#include "common/collision/proximity/moving_triangle.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Relative rounding error of a box's centre and size, per sum of their sizes.
constexpr double kBoxRounding = 32 * std::numeric_limits<double>::epsilon();
// Covers the rounding of a ball's radius and of the interval in which its centre stays in it.
constexpr double kBelowOne = 1 - 1e-9;
// Cubes that one sweep tests. A part that is nearer to the hull than it is divided, along much of
// the range, would need more.
constexpr int kMaxCubes = 2'000'000;
// Boxes and parts of triangles that a search for the centre of a ball in the hull opens, and the
// half size of the parts that it does not divide [m].
constexpr int kMaxOpened = 96;
constexpr double kUndividedHalf_m = 4e-3;

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
    found_.is_complete = cubes_left_ > 0;
    // A ball may reach beyond the range.
    for (auto* const list : {&found_.touching, &found_.colliding})
      for (SpacingInterval& i : *list)
        i = {std::max(i.low_m, range.low_m), std::min(i.high_m, range.high_m)};
    return std::move(found_);
  }

 private:
  void decide(SpacingInterval range) {
    if (cubes_left_ == 0 || !trim(range)) return;
    if (is_free(range)) return add(found_.free, range);
    const double mid_m = range.low_m / 2 + range.high_m / 2, half_m = mid_m - range.low_m;
    const double touching_m = kBelowOne * ball_radius(mid_m, half_m + 2 * options_.solid_m),
                 colliding_m = touching_m - options_.solid_m;
    if (touching_m > 0) add(found_.touching, {mid_m - touching_m, mid_m + touching_m});
    if (colliding_m > 0) add(found_.colliding, {mid_m - colliding_m, mid_m + colliding_m});
    const bool is_divisible = range.low_m < mid_m && mid_m < range.high_m;
    if (range.high_m - range.low_m <= options_.tolerance_m || !is_divisible) return;
    decide({range.low_m, mid_m});
    decide({mid_m, range.high_m});
  }

  // Shortens the range by the intervals that are known to collide. Returns false if they cover it.
  bool trim(SpacingInterval& range) const {
    for (const SpacingInterval& known : found_.colliding) {
      if (known.low_m <= range.low_m && known.high_m >= range.high_m) return false;
      if (known.low_m <= range.low_m && known.high_m > range.low_m) range.low_m = known.high_m;
      if (known.high_m >= range.high_m && known.low_m < range.high_m) range.high_m = known.low_m;
    }
    return true;
  }

  // Also false once the sweep has tested kMaxCubes.
  bool is_certified_free(const Box& box, double mid_m, double reach_m) {
    if (cubes_left_ == 0) return false;
    --cubes_left_;
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
                 reach_m = std::max(mid_m - range.low_m, range.high_m - mid_m),
                 finest_m = std::max(reach_m, options_.tolerance_m / 2);
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
      for (const std::uint32_t i : tree_.triangles_of(node.index)) parts_.push_back(part_at(i));
      while (!parts_.empty()) {
        const Part part = taken(parts_);
        if (is_certified_free(part.box, mid_m, reach_m)) continue;
        if (part.box.half_m.maxCoeff() <= finest_m || cubes_left_ == 0) return false;
        push_quarters(part.triangle, parts_);
      }
    }
    return true;
  }

  // Returns the largest radius found, up to enough_m, of a ball in the hull about a point of the
  // part's surface. Opens first what has its middle deepest in the hull, and the largest of those
  // that have it outside.
  double ball_radius(double spacing_m, double enough_m) {
    struct Candidate {
      double radius_m, half_m;  // of a ball in the hull about its middle, and its half size
      std::variant<Node, Part> what;
      bool operator<(const Candidate& other) const {
        return std::pair(radius_m, half_m) < std::pair(other.radius_m, other.half_m);
      }
    };
    std::priority_queue<Candidate> candidates;
    double best_m = 0;
    const auto radius_at = [&](const Vector3d& p_m) {
      return query_.solid_radius_m(p_m + spacing_m * axis_);
    };
    const auto push_boxes = [&](int level, int parent) {
      nodes_.clear();
      push_nodes(level, parent);
      for (const Node& node : nodes_)
        if (!is_certified_free(node.box, spacing_m, 0))
          candidates.push({radius_at(node.box.center_m), node.box.half_m.maxCoeff(), node});
    };
    const auto push_part = [&](const Part& part) {
      const double radius_m = radius_at(centroid(part.triangle));
      best_m = std::max(best_m, radius_m);
      candidates.push({radius_m, part.box.half_m.maxCoeff(), part});
    };
    if (!tree_.empty()) push_boxes(tree_.levels() - 1, 0);
    for (int opened = 0; opened < kMaxOpened && !candidates.empty() && best_m < enough_m;
         ++opened) {
      const Candidate next = candidates.top();
      candidates.pop();
      if (const Node* const node = std::get_if<Node>(&next.what)) {
        if (node->level > 0)
          push_boxes(node->level - 1, node->index);
        else
          for (const std::uint32_t i : tree_.triangles_of(node->index)) push_part(part_at(i));
      } else if (next.half_m > kUndividedHalf_m) {
        parts_.clear();
        push_quarters(std::get<Part>(next.what).triangle, parts_);
        for (const Part& quarter : parts_) push_part(quarter);
      }
    }
    return std::min(best_m, enough_m);
  }

  Part part_at(std::uint32_t triangle) const {
    return part_of(corners(tree_.mesh().triangles[triangle], tree_.mesh().vertices_m));
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
  int cubes_left_ = kMaxCubes;
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
  if (!(std::abs(range.low_m) <= kMaxSpacing_m && std::abs(range.high_m) <= kMaxSpacing_m &&
        range.low_m <= range.high_m))
    throw std::invalid_argument("spacing: the range must not descend nor exceed 1 km");
  if (query_->hull().unusable()) return {};
  if (!query_->hull().empty()) return Search(*this, part)(range);
  SpacingVerdicts all_free;
  all_free.free = {range};
  return all_free;
}

}  // namespace fivepipe::collision
