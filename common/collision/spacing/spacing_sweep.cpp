#include "common/collision/spacing/spacing_sweep.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <queue>
#include <stdexcept>
#include <utility>
#include <variant>

#include "common/collision/proximity/lazy_octree.h"
#include "common/collision/proximity/moving_triangle.h"
#include "common/collision/spacing/spacing_intervals.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Relative rounding error of a box's centre and size, per sum of their sizes.
constexpr double kBoxRounding = 32 * std::numeric_limits<double>::epsilon();
// Tests that one sweep makes at most. A part that slides along the hull, at a distance less than
// the size of its smallest pieces, would need more.
constexpr int kMaxTests = 2'000'000;
// Pieces of the part that are not free and are refined together.
constexpr std::size_t kMaxPieces = 4;
// Boxes and parts of triangles that a search for the centre of a ball in the hull opens. It does
// not divide parts with a half size of a sixteenth of the requested radius, within these bounds
// [m].
constexpr int kMaxOpened = 160;
constexpr double kMinUndividedHalf_m = 0.1e-3, kMaxUndividedHalf_m = 4e-3;

struct Box {
  Vector3d center_m, half_m;
};
// A box of the tree, not moved.
struct Node {
  int level, index;
  Box box;
};
// A part of a triangle, not moved.
struct Part {
  Triangle triangle;
  Box box;
};

using Piece = std::variant<Node, Part>;

const Box& box_of(const Piece& piece) {
  return std::visit([](const auto& p) -> const Box& { return p.box; }, piece);
}

Part part_of(const Triangle& t) {
  const Vector3d low = t[0].cwiseMin(t[1]).cwiseMin(t[2]),
                 high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
  return {t, {low / 2 + high / 2, high / 2 - low / 2}};
}

Vector3d centroid(const Triangle& t) { return (t[0] + t[1] + t[2]) / 3; }

void push_quarters(const Triangle& t, std::vector<Piece>& pieces) {
  const auto& [a, b, c] = t;
  const Vector3d ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
  for (const Triangle& quarter : {Triangle{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
    pieces.push_back(part_of(quarter));
}

template <class T>
T taken(std::vector<T>& from) {
  const T last = from.back();
  from.pop_back();
  return last;
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
        swept_(query_),
        tree_(part.tree()),
        axis_(part.axis_world()),
        offset_m_(part.move_world_m(0)) {}

  SpacingVerdicts operator()(const SpacingInterval& range) {
    std::vector<Piece> all;
    if (!tree_.empty()) push_nodes(tree_.levels() - 1, 0, all);
    waiting_.push({range, std::make_shared<const std::vector<Piece>>(std::move(all))});
    while (!waiting_.empty() && tests_left_ > 0) {
      const Waiting next = waiting_.top();
      waiting_.pop();
      decide(next.range, *next.pieces);
    }
    found_.is_complete = tests_left_ > 0;
    // A ball may reach beyond the range.
    for (auto* const list : {&found_.touching, &found_.colliding})
      for (SpacingInterval& i : *list)
        i = {std::max(i.low_m, range.low_m), std::min(i.high_m, range.high_m)};
    return std::move(found_);
  }

 private:
  struct Waiting {
    SpacingInterval range;
    // Both halves of a range share them. The rest of the part is certified free at each of its
    // spacings.
    std::shared_ptr<const std::vector<Piece>> pieces;
    double length_m() const { return range.high_m - range.low_m; }
    bool operator<(const Waiting& other) const {
      return std::pair(length_m(), -range.low_m) < std::pair(other.length_m(), -other.range.low_m);
    }
  };

  void decide(SpacingInterval range, const std::vector<Piece>& of_range) {
    if (!trim(range)) return;
    std::vector<Piece> pieces = not_free(range, of_range);
    if (pieces.empty()) return add(found_.free, range);
    const double mid_m = range.low_m / 2 + range.high_m / 2, half_m = mid_m - range.low_m;
    const double touching_m = kBelowOne * ball_radius(mid_m, half_m + 2 * options_.solid_m, pieces),
                 colliding_m = touching_m - options_.solid_m;
    if (touching_m > 0) add(found_.touching, {mid_m - touching_m, mid_m + touching_m});
    if (colliding_m > 0) add(found_.colliding, {mid_m - colliding_m, mid_m + colliding_m});
    const bool is_divisible = range.low_m < mid_m && mid_m < range.high_m;
    if (range.high_m - range.low_m <= options_.tolerance_m || !is_divisible) return;
    const auto shared = std::make_shared<const std::vector<Piece>>(std::move(pieces));
    waiting_.push({{range.low_m, mid_m}, shared});
    waiting_.push({{mid_m, range.high_m}, shared});
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

  // Returns true only if the volume that the piece sweeps within reach_m of the spacing is free of
  // the hull. Returns false once the sweep has made kMaxTests tests.
  bool is_certified_free(const Piece& piece, double spacing_m, double reach_m) {
    if (tests_left_ == 0) return false;
    --tests_left_;
    const auto& [center_m, half_m] = box_of(piece);
    const Vector3d move_m = offset_m_ + spacing_m * axis_;
    const double rounding_m =
        kBoxRounding * (center_m.cwiseAbs().sum() + half_m.sum() + offset_m_.cwiseAbs().sum() +
                        std::abs(spacing_m) + reach_m);
    const SweptMargin margin{reach_m * axis_, rounding_m};
    if (const Part* const part = std::get_if<Part>(&piece)) {
      const auto& [a, b, c] = part->triangle;
      return swept_.is_free(Triangle{a + move_m, b + move_m, c + move_m}, margin);
    }
    return swept_.is_free(Vector3d(center_m + move_m), half_m, margin);
  }

  // Returns the pieces of which the volume that they sweep in the range is not certified free.
  // Divides triangles down to the length of the range; beyond kMaxPieces, nothing is tested.
  std::vector<Piece> not_free(const SpacingInterval& range, std::vector<Piece> pieces) {
    const double mid_m = range.low_m / 2 + range.high_m / 2,
                 reach_m = std::max(mid_m - range.low_m, range.high_m - mid_m),
                 finest_m = std::max(reach_m, options_.tolerance_m / 2);
    std::vector<Piece> left;
    while (!pieces.empty() && left.size() < kMaxPieces) {
      const Piece piece = taken(pieces);
      if (is_certified_free(piece, mid_m, reach_m)) continue;
      if (is_divisible(piece, finest_m) && tests_left_ > 0)
        push_pieces_of(piece, pieces);
      else
        left.push_back(piece);
    }
    left.insert(left.end(), pieces.begin(), pieces.end());
    return left;
  }

  static bool is_divisible(const Piece& piece, double finest_m) {
    const Part* const part = std::get_if<Part>(&piece);
    return !part || part->box.half_m.maxCoeff() > finest_m;
  }

  void push_pieces_of(const Piece& piece, std::vector<Piece>& pieces) const {
    if (const Part* const part = std::get_if<Part>(&piece))
      return push_quarters(part->triangle, pieces);
    const Node& node = std::get<Node>(piece);
    if (node.level > 0) return push_nodes(node.level - 1, node.index, pieces);
    for (const std::uint32_t i : tree_.triangles_of(node.index)) pieces.push_back(part_at(i));
  }

  // Returns the largest radius found, up to enough_m, of a ball in the hull about a point of the
  // pieces. Opens first what has its middle deepest in the hull, and the largest of those that have
  // it outside; what is certified free is not opened.
  double ball_radius(double spacing_m, double enough_m, const std::vector<Piece>& pieces) {
    struct Candidate {
      double radius_m, half_m;  // of a ball in the hull about its middle, and its half size
      Piece piece;
      bool operator<(const Candidate& other) const {
        return std::pair(radius_m, half_m) < std::pair(other.radius_m, other.half_m);
      }
    };
    const double undivided_half_m =
        std::clamp(enough_m / 16, kMinUndividedHalf_m, kMaxUndividedHalf_m);
    std::priority_queue<Candidate> candidates;
    double best_m = 0;
    const auto push = [&](const Piece& piece) {
      const Box& box = box_of(piece);
      if (is_certified_free(piece, spacing_m, 0)) return;
      const Part* const part = std::get_if<Part>(&piece);
      const Vector3d middle_m = part ? centroid(part->triangle) : box.center_m;
      const double radius_m = query_.solid_radius_m(middle_m + offset_m_ + spacing_m * axis_);
      if (part) best_m = std::max(best_m, radius_m);
      candidates.push({radius_m, box.half_m.maxCoeff(), piece});
    };
    for (const Piece& piece : pieces) push(piece);
    std::vector<Piece> opened_pieces;
    for (int opened = 0; opened < kMaxOpened && !candidates.empty() && best_m < enough_m;
         ++opened) {
      const Piece next = candidates.top().piece;
      candidates.pop();
      if (!is_divisible(next, undivided_half_m)) continue;
      opened_pieces.clear();
      push_pieces_of(next, opened_pieces);
      for (const Piece& piece : opened_pieces) push(piece);
    }
    return std::min(best_m, enough_m);
  }

  Part part_at(std::uint32_t triangle) const {
    return part_of(corners(tree_.mesh().triangles[triangle], tree_.mesh().vertices_m));
  }

  void push_nodes(int level, int parent, std::vector<Piece>& pieces) const {
    const Bvh::Boxes& boxes = tree_.boxes(level, parent);
    for (std::size_t i = 0; i < Bvh::kArity; ++i) {
      const Vector3d center_m(boxes.center_m[0][i], boxes.center_m[1][i], boxes.center_m[2][i]),
          half_m(boxes.half_m[0][i], boxes.half_m[1][i], boxes.half_m[2][i]);
      if (half_m.x() >= 0)
        pieces.push_back(
            Node{level, parent * Bvh::kArity + int(i), {tree_.origin_m() + center_m, half_m}});
    }
  }

  const hull::HullQuery& query_;
  const SpacingOptions& options_;
  CubeQuery swept_;
  const Bvh& tree_;
  Vector3d axis_;
  Vector3d offset_m_;  // at spacing 0
  SpacingVerdicts found_;
  // The longest first: a search that reaches its limit leaves only the shortest undecided, which
  // are beside contact.
  std::priority_queue<Waiting> waiting_;
  int tests_left_ = kMaxTests;
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
