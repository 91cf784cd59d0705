#include "common/collision/proximity/proximity_search.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Largest coordinate, in caps, at which lattice cubes have exact coordinates. Farther out only
// free_radius_m() is used.
constexpr double kMaxCoordinate_caps = 1e9;

// Accuracy of the bisection that moves a hull point towards the shape, as a fraction of the
// tolerance.
constexpr double kApproachTolerance = 0.125;

// Smallest cube that the first pass opens, as a fraction of the tolerance.
constexpr double kInitialLeafSize = 1;

// Largest half extent of a piece of a triangle, in caps. A piece and the cap around it are within
// half an edge of a lattice cube of the piece's center.
constexpr double kPiece_caps = 0.9;

// Squared distances along one axis between a shape's box and the two halves of a cube.
struct Gaps {
  double m2[2];
  Gaps(double from_center_m, double half_extent_m, double half_edge_m) {
    const double quarter_m = half_edge_m / 2;
    for (int i = 0; i < 2; ++i) {
      const double gap_m = std::max(0.0, std::abs(from_center_m + (i ? -quarter_m : quarter_m)) -
                                             (quarter_m + half_extent_m));
      m2[i] = gap_m * gap_m;
    }
  }
};

}  // namespace

// Searches the hull's nearest point to one shape. The shape and the cap around it must be inside
// the lattice cubes around the shape's center.
template <class Shape>
class HullProximity::Search::Nearest {
 public:
  Nearest(Search& search, const Shape& shape, double max_m, int thread)
      : search_(search),
        query_(search.query),
        options_(search.options),
        shape_(shape),
        thread_(thread),
        rounding_m_(shape.rounding_m(kRootEdge_caps * search.options.cap_m)),
        now_(search.candidates[std::size_t(thread)].now),
        later_(search.candidates[std::size_t(thread)].later) {
    set_upper_bound(max_m);
  }

  // Iterative deepening: searches depth first, nearest cube first, down to a cube size; then
  // continues with the remaining cubes down to half that size, and so on. Opening small cubes pays
  // off only after the search has found hull points.
  Proximity operator()() {
    const double finest_m = kFinestCube * options_.tolerance_m / 2,
                 root_m = search_.cells.root_edge_m() / 2;
    double skipped_m2 = kInfinity;  // lower bound for the cubes that are too small to open
    int opened = 0;
    now_.clear();
    later_.clear();
    for (const LazyOctree::Cube& cube : search_.cells.neighborhood(shape_.center, thread_)) {
      const Vector3d beyond_m = (shape_.center - cube.center_world_m).cwiseAbs() -
                                shape_.half_extents_m - Vector3d::Constant(root_m);
      now_.push_back({beyond_m.cwiseMax(0).squaredNorm(), cube, root_m});
    }
    std::sort(now_.begin(), now_.end());
    for (double smallest_m = kInitialLeafSize * options_.tolerance_m / 2; !now_.empty();
         smallest_m /= 2) {
      while (!now_.empty()) {
        const Candidate next = now_.back();
        now_.pop_back();
        if (!(next.to_m2 < enough_m2_)) continue;
        if (next.half_edge_m < smallest_m) {
          later_.push_back(next);
        } else if (next.half_edge_m < finest_m || opened == kMaxCubesOpened) {
          skipped_m2 = std::min(skipped_m2, next.to_m2);
        } else {
          ++opened;
          open(next);
        }
      }
      std::sort(later_.begin(), later_.end());
      std::swap(now_, later_);
    }
    return bounds(skipped_m2);
  }

 private:
  void set_upper_bound(double max_m) {
    max_m_ = max_m;
    enough_m_ = std::min(options_.cap_m, max_m - options_.tolerance_m);
    enough_m2_ = enough_m_ > 0 ? (enough_m_ + rounding_m_) * (enough_m_ + rounding_m_) : 0;
  }

  void open(const Candidate& cube) {
    LazyOctree::Octants& octants = search_.cells.octants(cube.cube, cube.half_edge_m, thread_);
    const auto center_of = [&](int i) {
      return LazyOctree::center_of_octant(cube.cube.center_world_m, cube.half_edge_m, i);
    };
    for (unsigned left = octants.in_hull; left; left &= left - 1)
      approach(center_of(std::countr_zero(left)), cube.half_edge_m);
    const Vector3d off_m = shape_.center - cube.cube.center_world_m,
                   &half_m = shape_.half_extents_m;
    const Gaps x(off_m.x(), half_m.x(), cube.half_edge_m),
        y(off_m.y(), half_m.y(), cube.half_edge_m), z(off_m.z(), half_m.z(), cube.half_edge_m);
    double to_m2[8];
    unsigned near = 0;
    for (int i = 0; i < 8; ++i) {
      to_m2[i] = x.m2[i & 1] + y.m2[i >> 1 & 1] + z.m2[i >> 2];
      near |= unsigned(to_m2[i] < enough_m2_) << i;
    }
    const std::size_t before = now_.size();
    for (unsigned left = near & octants.not_free; left; left &= left - 1) {
      const int i = std::countr_zero(left);
      const Vector3d center_world_m = center_of(i);
      const double nearer_m2 = shape_.to_cube_m2(center_world_m, cube.half_edge_m / 2, to_m2[i]);
      if (!(nearer_m2 < enough_m2_)) continue;
      now_.push_back(
          {nearer_m2, {&octants.children[std::size_t(i)], center_world_m}, cube.half_edge_m / 2});
      for (std::size_t k = now_.size() - 1; k > before && now_[k - 1].to_m2 < now_[k].to_m2; --k)
        std::swap(now_[k - 1], now_[k]);
    }
  }

  // Lowers the upper bound if p is in the hull and nearer than max_m. Steps from p towards the
  // shape with growing steps and bisects, to find a nearer hull point.
  void approach(const Vector3d& p_world_m, double step_m) {
    const Vector3d to = shape_.nearest_to(p_world_m), offset = p_world_m - to;
    const double length_m2 = offset.squaredNorm();
    if (!(length_m2 < max_m_ * max_m_)) return;
    const double length_m = std::sqrt(length_m2);
    if (!(length_m + rounding_m_ < max_m_) || !query_.contains(p_world_m)) return;
    if (query_.contains(to)) return set_upper_bound(0);
    const Vector3d direction = offset / length_m;
    double inside_m = length_m, outside_m = length_m - step_m;
    for (; outside_m > 0 && query_.contains(to + outside_m * direction);
         outside_m -= 2 * (length_m - outside_m))
      inside_m = outside_m;
    outside_m = std::max(outside_m, 0.0);
    while (inside_m - outside_m > kApproachTolerance * options_.tolerance_m) {
      const double between_m = (inside_m + outside_m) / 2;
      if (!(between_m > outside_m && between_m < inside_m)) break;
      (query_.contains(to + between_m * direction) ? inside_m : outside_m) = between_m;
    }
    set_upper_bound(inside_m + rounding_m_);
  }

  Proximity bounds(double skipped_m2) const {
    if (!(max_m_ > 0)) return kInHull;
    double min_m = std::max(0.0, std::min(enough_m_, std::sqrt(skipped_m2) - rounding_m_));
    if (min_m < enough_m_)
      min_m = std::clamp(
          query_.free_radius_m(shape_.center) - shape_.half_extents_m.norm() - rounding_m_, min_m,
          max_m_);
    if (min_m >= options_.cap_m) return {options_.cap_m, kInfinity};
    return {min_m, max_m_};
  }

  Search& search_;
  const hull::HullQuery& query_;
  const ProximityOptions& options_;
  const Shape& shape_;
  int thread_;
  double rounding_m_;
  std::vector<Candidate>&now_, &later_;
  // Upper bound found so far; cubes that are not nearer than enough_m_ cannot improve it by more
  // than the tolerance.
  double max_m_, enough_m_, enough_m2_;
};

// Answers queries that need no search: the point is not finite, the hull is empty or unusable, or
// the point is too far from the origin for the lattice.
std::optional<Proximity> HullProximity::Search::trivial_proximity(const Vector3d& p_world_m) const {
  if (!p_world_m.allFinite() || query.hull().unusable()) return kUnknown;
  if (query.hull().empty()) return kEmptyHull;
  if (p_world_m.cwiseAbs().maxCoeff() < kMaxCoordinate_caps * options.cap_m) return std::nullopt;
  if (query.contains(p_world_m)) return kInHull;
  const double free_m = query.free_radius_m(p_world_m);
  return free_m >= options.cap_m ? Proximity{options.cap_m, kInfinity}
                                 : Proximity{free_m, kInfinity};
}

Proximity HullProximity::Search::of_point(const Vector3d& p_world_m, int thread) {
  if (const auto trivial = trivial_proximity(p_world_m)) return *trivial;
  const auto& neighborhood = cells.neighborhood(p_world_m, thread);
  if (neighborhood.empty()) return {options.cap_m, kInfinity};
  if (query.contains(p_world_m)) return kInHull;
  return Nearest(*this, PointShape{p_world_m}, kInfinity, thread)();
}

// Splits the triangle into pieces that fit the cubes around their centers. Skips a piece if its
// circumscribed ball is beyond the cap.
Proximity HullProximity::Search::of_piece(const TriangleShape& piece, double max_m, int thread) {
  const double half_m = piece.half_extents_m.maxCoeff();
  if (half_m <= kPiece_caps * options.cap_m) return Nearest(*this, piece, max_m, thread)();
  if (query.free_radius_m(piece.center) >=
      options.cap_m + std::sqrt(3.0) * half_m + piece.rounding_m(options.cap_m))
    return {options.cap_m, kInfinity};
  Proximity whole{options.cap_m, kInfinity};
  const auto& [a, b, c] = piece.t;
  const Vector3d ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
  for (const Triangle& part : {Triangle{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) {
    const Proximity p = of_piece(TriangleShape(part), std::min(max_m, whole.max_m), thread);
    if (!(p.max_m > 0)) return kInHull;
    whole = {std::min(whole.min_m, p.min_m), std::min(whole.max_m, p.max_m)};
  }
  return whole;
}

Proximity HullProximity::Search::of_triangle(Triangle triangle, const Proximity& known,
                                             int thread) {
  for (const Vector3d& vertex : triangle)
    if (!vertex.allFinite()) return kUnknown;
  for (const Vector3d& vertex : triangle)
    if (const auto trivial = trivial_proximity(vertex))
      return trivial->min_m == kInfinity ? kEmptyHull : kUnknown;
  if (known.max_m - known.min_m <= options.tolerance_m) return known;
  std::sort(triangle.begin(), triangle.end(), [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  return of_piece(TriangleShape(triangle), known.max_m, thread);
}

}  // namespace fivepipe::collision
