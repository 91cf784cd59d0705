#include "common/collision/proximity.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "common/collision/proximity_cells.h"

namespace fivepipe {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Proximity kInHull{0, 0}, kNoHullAtAll{kInfinity, kInfinity}, kUnknown{0, kInfinity};

// Points that a thread takes together.
constexpr int kTogether = 64;

// Of distances between points, in the sizes of their coordinates: fewer than 20 roundings.
constexpr double kRoundings = 32 * std::numeric_limits<double>::epsilon();

// Farther out than so many caps, lattice cubes have no exact coordinates any more: free_radius_m alone is said.
constexpr double kFarthest_caps = 1e9;

// A hull point is moved towards the asked one until it is so near to the first that may be one, as a fraction of the tolerance.
constexpr double kNearEnough = 0.125;

// Edge of the lattice's cubes, and the half extent of the pieces that triangles are cut into: a piece and the cap around it lie within half
// an edge of the piece's middle.
constexpr double kRootEdge_caps = 4, kPiece_caps = 0.9;

// The nearest point of a sliver is told only to about the square root of what double tells, of the lengths that take part: where its
// height is below that, weights are noise and one of its edges stands for it.
constexpr double kTriangleRounding = 1e-7;

template <class Work>
void for_many(WorkerPool& pool, std::size_t count, const Work& work) {
  pool.run(int((count + kTogether - 1) / kTogether), [&](int piece, int thread) {
    const std::size_t begin = std::size_t(piece) * kTogether;
    for (std::size_t i = begin; i < std::min(begin + kTogether, count); ++i) work(i, thread);
  });
}

// What is asked of: a box around it, its nearest point to another, and, where the box is not all, how near a cube may come to it.
struct PointShape {
  Vector3d p_world_m;

  const Vector3d& middle() const { return p_world_m; }
  Vector3d half_extents_m() const { return Vector3d::Zero(); }
  const Vector3d& nearest_to(const Vector3d&) const { return p_world_m; }
  double rounding_m(double reach_m) const { return kRoundings * (p_world_m.cwiseAbs().sum() + reach_m); }
  double to_cube_m2(const Vector3d&, double, double to_box_m2) const { return to_box_m2; }
};

// (Ericson, Real-Time Collision Detection, 2005, 5.1.) All candidates are points of the triangle, whatever rounding does to their weights.
struct TriangleShape {
  Triangle t;

  Vector3d middle() const { return t[0].cwiseMin(t[1]).cwiseMin(t[2]) / 2 + t[0].cwiseMax(t[1]).cwiseMax(t[2]) / 2; }
  Vector3d half_extents_m() const { return t[0].cwiseMax(t[1]).cwiseMax(t[2]) / 2 - t[0].cwiseMin(t[1]).cwiseMin(t[2]) / 2; }
  Vector3d nearest_to(const Vector3d& p) const {
    Vector3d nearest = t[0];
    const auto consider = [&](const Vector3d& q) {
      if ((q - p).squaredNorm() < (nearest - p).squaredNorm()) nearest = q;
    };
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d &a = t[i], ab = t[(i + 1) % 3] - a;
      const double length2 = ab.squaredNorm();
      consider(length2 > 0 ? Vector3d(a + std::clamp(ab.dot(p - a) / length2, 0.0, 1.0) * ab) : a);
    }
    const Vector3d ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0], normal = ab.cross(ac);
    const double weight_b = ap.cross(ac).dot(normal), weight_c = ab.cross(ap).dot(normal), sum = normal.squaredNorm();
    if (weight_b >= 0 && weight_c >= 0 && sum > 0 && weight_b + weight_c <= sum) consider(t[0] + weight_b / sum * ab + weight_c / sum * ac);
    return nearest;
  }
  // The triangle's edges and distance count: see kTriangleRounding.
  double rounding_m(double reach_m) const { return kRoundings * (t[0].cwiseAbs().sum() + reach_m) + kTriangleRounding * (2 * half_extents_m().sum() + reach_m); }
  double to_cube_m2(const Vector3d& center_world_m, double half_edge_m, double to_box_m2) const {
    const double to_m = (nearest_to(center_world_m) - center_world_m).norm() - std::sqrt(3.0) * half_edge_m;
    return to_m > 0 ? std::max(to_box_m2, to_m * to_m) : to_box_m2;
  }
};

// A cube that may hold nearer hull points than those found.
struct Candidate {
  double to_m2;  // no point of it is nearer
  ProximityCells::Cube cube;
  double half_edge_m;
  bool operator<(const Candidate& other) const { return to_m2 > other.to_m2; }  // the nearest is a heap's first
};

// Squared distances along one axis between a shape's box and the lower and upper half of a cube.
struct Gaps {
  double m2[2];
  Gaps(double from_center_m, double half_extent_m, double half_edge_m) {
    const double quarter_m = half_edge_m / 2;
    for (int i = 0; i < 2; ++i) {
      const double gap_m = std::max(0.0, std::abs(from_center_m + (i ? -quarter_m : quarter_m)) - (quarter_m + half_extent_m));
      m2[i] = gap_m * gap_m;
    }
  }
};

}  // namespace

struct HullProximity::Search {
  const HullQuery& query;
  ProximityOptions options;
  ProximityCells cells;
  std::vector<std::vector<Candidate>> heaps;  // one per thread

  Search(const HullQuery& q, const ProximityOptions& o)
      : query(q), options(o), cells(q, kRootEdge_caps * o.cap_m, q.hull().pool().threads()), heaps(std::size_t(q.hull().pool().threads())) {}

  template <class Shape>
  Proximity nearest(const Shape& shape, double most_m, int thread);
  template <class Shape>
  bool approach(const Shape& shape, const Vector3d& p_world_m, double least_m, double rounding_m, double& most_m) const;
  std::optional<Proximity> without_search(const Vector3d& p_world_m) const;
  Proximity of_point(const Vector3d& p_world_m, int thread);
  Proximity of_triangle(Triangle triangle, double most_m, int thread);
  Proximity of_piece(const TriangleShape& piece, double most_m, int thread);
};

// Where p is in the hull, and nearer than most_m: that becomes its distance from the shape, or that of a hull point on the way there.
template <class Shape>
bool HullProximity::Search::approach(const Shape& shape, const Vector3d& p_world_m, double least_m, double rounding_m, double& most_m) const {
  const Vector3d to = shape.nearest_to(p_world_m), way = p_world_m - to;
  const double length_m = way.norm();
  if (!(length_m + rounding_m < most_m) || !query.contains(p_world_m)) return false;
  if (query.contains(to)) {
    most_m = 0;
    return true;
  }
  double outside_m = std::min(least_m, length_m), inside_m = length_m;
  while (inside_m - outside_m > kNearEnough * options.tolerance_m) {
    const double between_m = (inside_m + outside_m) / 2;
    if (!(between_m > outside_m && between_m < inside_m)) break;
    (query.contains(to + between_m / length_m * way) ? inside_m : outside_m) = between_m;
  }
  most_m = inside_m + rounding_m;
  return true;
}

// Best first. The shape lies, with the cap around it, in the cubes around its middle.
template <class Shape>
Proximity HullProximity::Search::nearest(const Shape& shape, double most_m, int thread) {
  std::vector<Candidate>& heap = heaps[std::size_t(thread)];
  heap.clear();
  const Vector3d middle = shape.middle(), half_extents_m = shape.half_extents_m();
  const double rounding_m = shape.rounding_m(kRootEdge_caps * options.cap_m), finest_m = kFinestCube * options.tolerance_m / 2;
  double left_out_m2 = kInfinity;  // the nearest of the cubes that are not looked into
  double enough_m2 = 0;            // what is not nearer need not be
  const auto set_enough = [&] {
    const double enough_m = std::min(options.cap_m, most_m - options.tolerance_m) + rounding_m;
    enough_m2 = enough_m > 0 ? enough_m * enough_m : 0;
  };
  set_enough();
  for (const ProximityCells::Cube& cube : cells.around(middle, thread)) {
    const double half_edge_m = cells.root_edge_m() / 2;
    const double to_m2 = ((middle - cube.center_world_m).cwiseAbs() - half_extents_m - Vector3d::Constant(half_edge_m)).cwiseMax(0).squaredNorm();
    if (to_m2 < enough_m2) heap.push_back({to_m2, cube, half_edge_m});
    else left_out_m2 = std::min(left_out_m2, to_m2);
  }
  std::make_heap(heap.begin(), heap.end());
  for (int opened = 0; !heap.empty() && heap.front().to_m2 < enough_m2 && opened < kMostCubesOpened; ++opened) {
    const Candidate next = heap.front();
    std::pop_heap(heap.begin(), heap.end());
    heap.pop_back();
    ProximityCells::Eighths& eighths = cells.eighths(next.cube, next.half_edge_m, thread);
    const Vector3d from_center_m = middle - next.cube.center_world_m;
    const Gaps x(from_center_m.x(), half_extents_m.x(), next.half_edge_m), y(from_center_m.y(), half_extents_m.y(), next.half_edge_m), z(from_center_m.z(), half_extents_m.z(), next.half_edge_m);
    for (unsigned left = eighths.not_free; left; left &= left - 1) {
      const int i = std::countr_zero(left);
      double to_m2 = x.m2[i & 1] + y.m2[i >> 1 & 1] + z.m2[i >> 2];
      const Vector3d center_world_m = ProximityCells::center_of_eighth(next.cube.center_world_m, next.half_edge_m, i);
      if ((eighths.in_hull >> i & 1) && approach(shape, center_world_m, std::sqrt(next.to_m2), rounding_m, most_m)) set_enough();
      if (to_m2 < enough_m2) to_m2 = shape.to_cube_m2(center_world_m, next.half_edge_m / 2, to_m2);
      if (to_m2 < enough_m2 && next.half_edge_m / 2 >= finest_m) {
        heap.push_back({to_m2, {&eighths.inside[std::size_t(i)], center_world_m}, next.half_edge_m / 2});
        std::push_heap(heap.begin(), heap.end());
      } else {
        left_out_m2 = std::min(left_out_m2, to_m2);
      }
    }
  }
  if (!(most_m > 0)) return kInHull;
  const double to_rest_m = std::sqrt(std::min(left_out_m2, heap.empty() ? kInfinity : heap.front().to_m2)) - rounding_m;
  const double least_m = std::clamp(to_rest_m, 0.0, most_m);
  if (least_m >= options.cap_m) return {options.cap_m, kInfinity};
  return {least_m, most_m};
}

// What needs no search: what is not finite or has no hull, and what is too far out for cubes.
std::optional<Proximity> HullProximity::Search::without_search(const Vector3d& p_world_m) const {
  if (!p_world_m.allFinite() || query.hull().unusable()) return kUnknown;
  if (query.hull().empty()) return kNoHullAtAll;
  if (p_world_m.cwiseAbs().maxCoeff() < kFarthest_caps * options.cap_m) return std::nullopt;
  if (query.contains(p_world_m)) return kInHull;
  const double free_m = query.free_radius_m(p_world_m);
  return free_m >= options.cap_m ? Proximity{options.cap_m, kInfinity} : Proximity{free_m, kInfinity};
}

Proximity HullProximity::Search::of_point(const Vector3d& p_world_m, int thread) {
  if (const auto said = without_search(p_world_m)) return *said;
  const auto& around = cells.around(p_world_m, thread);
  if (around.empty()) return {options.cap_m, kInfinity};
  if (query.contains(p_world_m)) return kInHull;
  return nearest(PointShape{p_world_m}, kInfinity, thread);
}

// Pieces that the cubes around their middles hold; of those beyond the cap by their circumscribed ball, none.
Proximity HullProximity::Search::of_piece(const TriangleShape& piece, double most_m, int thread) {
  const Vector3d middle = piece.middle();
  const double half_m = piece.half_extents_m().maxCoeff();
  if (half_m <= kPiece_caps * options.cap_m) return nearest(piece, most_m, thread);
  if (query.free_radius_m(middle) >= options.cap_m + std::sqrt(3.0) * half_m * (1 + kRoundings)) return {options.cap_m, kInfinity};
  Proximity whole{options.cap_m, kInfinity};
  const auto& [a, b, c] = piece.t;
  const Vector3d ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
  for (const TriangleShape& part : {TriangleShape{{a, ab, ca}}, TriangleShape{{ab, b, bc}}, TriangleShape{{ca, bc, c}}, TriangleShape{{ab, bc, ca}}}) {
    const Proximity p = of_piece(part, std::min(most_m, whole.most_m), thread);
    if (!(p.most_m > 0)) return kInHull;
    whole = {std::min(whole.least_m, p.least_m), std::min(whole.most_m, p.most_m)};
  }
  return whole;
}

Proximity HullProximity::Search::of_triangle(Triangle triangle, double most_m, int thread) {
  for (const Vector3d& vertex : triangle)
    if (!vertex.allFinite()) return kUnknown;
  for (const Vector3d& vertex : triangle)
    if (const auto said = without_search(vertex)) return said->least_m == kInfinity ? kNoHullAtAll : kUnknown;
  std::sort(triangle.begin(), triangle.end(), [](const Vector3d& a, const Vector3d& b) { return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3); });
  return of_piece({triangle}, most_m, thread);
}

HullProximity::HullProximity(const HullQuery& query, const ProximityOptions& options) {
  if (!(options.cap_m > 0 && std::isfinite(options.cap_m) && options.tolerance_m > 0)) throw std::invalid_argument("proximity: cap and tolerance must be above 0, the cap finite");
  search_ = std::make_unique<Search>(query, options);
}
HullProximity::~HullProximity() = default;

void HullProximity::of_points(std::span<const Vector3d> p_world_m, std::span<Proximity> proximity) {
  for_many(search_->query.hull().pool(), p_world_m.size(), [&](std::size_t i, int thread) { proximity[i] = search_->of_point(p_world_m[i], thread); });
}

void HullProximity::of_triangles(std::span<const Triangle> triangles, std::span<Proximity> proximity) {
  for_many(search_->query.hull().pool(), triangles.size(), [&](std::size_t i, int thread) { proximity[i] = search_->of_triangle(triangles[i], kInfinity, thread); });
}

std::size_t HullProximity::cubes_asked() const { return search_->cells.asked(); }

MeshProximity mesh_proximity(HullProximity& hull, const Mesh& mesh, const Eigen::Isometry3d& world_from_object) {
  std::vector<Vector3d> vertices_world_m;
  vertices_world_m.reserve(mesh.vertices_m.size());
  for (const Vector3d& v : mesh.vertices_m) vertices_world_m.push_back(world_from_object * v);
  MeshProximity found{std::vector<Proximity>(mesh.vertices_m.size()), std::vector<Proximity>(mesh.triangles.size())};
  hull.of_points(vertices_world_m, found.vertices);
  hull.of_triangles(world_triangles(mesh, world_from_object), found.triangles);
  return found;
}

}  // namespace fivepipe
