#include "common/collision/detection/cpu/triangle_walk.h"

#include <algorithm>
#include <cmath>

#include "common/collision/detection/cpu/box_clip.h"
#include "common/hull/image_cone.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Mixed parts are split down to eps_m divided by this; at that size few parts are mixed.
constexpr double kFinest = 16;
// A triangle that is too large for float, or too close to a camera's plane, is repeatedly cut into
// four: at most this many times, and into at most this many parts.
constexpr int kMaxCuts = 10;
constexpr int kMaxParts = 4096;
// Maximum number of parts tested together; only the hull of a noisy map exceeds it.
constexpr std::size_t kMaxCells = 1 << 16;
// Maximum number of parts that are tested in double.
constexpr std::size_t kMaxExactTests = 1024;
// Parts with at most this many samples per edge are sampled instead of classified.
constexpr double kMaxSamplesPerEdge = 4;
// Samples are the centers of the parts. Neighbours are two thirds of a part's median apart, and the
// median is no longer than the longest edge.
constexpr double kSampleDistance = 2.0 / 3;
// Divisions of the coarse test, for the verdict alone: 16 parts, one SIMD vector.
constexpr int kCoarseDivisions = 4;

// Lexicographical order of the coordinates.
bool before(const Vector3d& a, const Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

std::array<std::size_t, 3> vertex_order(const Triangle& t) {
  std::array<std::size_t, 3> order = {0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return before(t[a], t[b]); });
  return order;
}

TriangleGrid triangle_grid(const Triangle& v, const TriangleWalkOptions& options,
                           double spacing_m) {
  const double longest_m =
      std::max({(v[1] - v[0]).norm(), (v[2] - v[0]).norm(), (v[2] - v[1]).norm()});
  TriangleGrid grid;
  if (spacing_m > 0) {
    const double max_divisions = std::max(1.0, std::floor(std::sqrt(double(options.max_points)))),
                 needed = kSampleDistance * longest_m / spacing_m;
    while (grid.divisions < needed && 2 * grid.divisions <= max_divisions) {
      if (grid.start == 1 && grid.divisions >= 2 && 3 * (grid.divisions / 2) >= needed)
        grid.start = 3, grid.divisions = 3 * (grid.divisions / 2);
      else
        grid.divisions *= 2;
    }
    grid.coarser = grid.divisions < needed;
  }
  grid.units = grid.divisions;
  while (grid.units <= kMaxUnits && longest_m / grid.units > options.eps_m / kFinest)
    grid.units *= 2;
  return grid;
}

TriangleWalk::TriangleWalk(const hull::HullQuery& query, const TriangleWalkOptions& options)
    : query_(&query),
      options_(options),
      rule_{query.hull().rule()},
      inner_box_world_m_(inner_box(rule_.hull.within_world_m)) {
  for (const hull::CpuHull::MapCamera& camera : query.hull().cameras())
    cameras_.push_back({pixel_from_world(camera.camera), hull::image_of(camera.camera)});
}

TriangleContact TriangleWalk::walk(const Triangle& triangle_world_m, bool solid,
                                   const PointRequest& request, ContactPoints& points) {
  contact_ = {};
  points_ = &points;
  points.begin_triangle();
  request_ = request;
  parts_ = 0;
  farthest_m2_ = -1;
  const auto [first, second, third] = vertex_order(triangle_world_m);
  const Triangle sorted = {triangle_world_m[first], triangle_world_m[second],
                           triangle_world_m[third]};
  is_clipped_ = !std::all_of(sorted.begin(), sorted.end(),
                             [&](const Vector3d& v) { return inner_box_world_m_.contains(v); });
  contact_.verdict = is_clipped_ ? walk_in_box(sorted)
                     : solid     ? accept_all(sorted)
                                 : walk_part(sorted, 0);
  if (farthest_m2_ >= 0 && points.back() != farthest_world_m_) points.add(farthest_world_m_);
  return contact_;
}

// Decides a triangle that is at the rule's box or partly outside: clips it, and decides the
// triangles of the polygon that remains.
CollisionVerdict TriangleWalk::walk_in_box(const Triangle& vertices) {
  const std::vector<Vector3d> polygon = clipped_to_box(vertices, rule_.hull.within_world_m);
  CollisionVerdict worst = CollisionVerdict::free;
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    worst = std::max(worst, walk_part({polygon[0], polygon[i - 1], polygon[i]}, 0));
    if (worst == CollisionVerdict::colliding && !(request_.spacing_m > 0)) break;
  }
  return worst;
}

// Decides a part of the triangle: samples it, or cuts it if float cannot decide it.
CollisionVerdict TriangleWalk::walk_part(const Triangle& vertices, int depth) {
  vertices_ = vertices;
  choose_grid();
  const Maps maps = set_maps();
  if (maps == Maps::free) return CollisionVerdict::free;
  const bool too_large = units_ > kMaxUnits;
  if (maps == Maps::some || too_large) {
    begin_cells(1);
    mixed_.clear(), solid_.clear();
    classify_cells(maps_, cells_, float(units_), mixed_, solid_, rule_);
    if (mixed_.count + solid_.count == 0) return CollisionVerdict::free;
    return depth < kMaxCuts && parts_ < kMaxParts ? split_part(vertices, depth)
                                                  : test_corners(vertices);
  }
  const bool found = request_.spacing_m > 0 ? sample() : coarse_test();
  return found ? CollisionVerdict::colliding : decide();
}

// Accepts every sample of a triangle that is wholly in the hull.
CollisionVerdict TriangleWalk::accept_all(const Triangle& vertices) {
  if (!(request_.spacing_m > 0)) {
    add((vertices[0] + vertices[1] + vertices[2]) / 3);
    return CollisionVerdict::colliding;
  }
  vertices_ = vertices;
  choose_grid();
  contact_.coarser |= coarser_;
  begin_cells(1);
  std::swap(cells_, solid_);
  accept_solid(units_, units_ / divisions_);
  return CollisionVerdict::colliding;
}

// Decides the four quarters of a part.
CollisionVerdict TriangleWalk::split_part(const Triangle& v, int depth) {
  const Vector3d m01 = 0.5 * (v[0] + v[1]), m02 = 0.5 * (v[0] + v[2]), m12 = 0.5 * (v[1] + v[2]);
  CollisionVerdict worst = CollisionVerdict::free;
  parts_ += 4;
  for (const Triangle& part : {Triangle{v[0], m01, m02}, Triangle{m01, v[1], m12},
                               Triangle{m02, m12, v[2]}, Triangle{m01, m12, m02}}) {
    worst = std::max(worst, walk_part(part, depth + 1));
    if (worst == CollisionVerdict::colliding && !(request_.spacing_m > 0)) break;
  }
  return worst;
}

// Tests the corners of a part in double, because the triangle may not be cut further.
CollisionVerdict TriangleWalk::test_corners(const Triangle& vertices) {
  contact_.cut_off = true;
  bool any = false;
  for (const Vector3d& v : vertices) {
    ++contact_.points_in_double;
    if (!query_->contains(v)) continue;
    any = true;
    add(v);
    if (!(request_.spacing_m > 0)) break;
  }
  return any ? CollisionVerdict::colliding : CollisionVerdict::undecided;
}

void TriangleWalk::choose_grid() {
  const TriangleGrid grid = triangle_grid(vertices_, options_, request_.spacing_m);
  start_ = grid.start, divisions_ = grid.divisions, units_ = grid.units, coarser_ = grid.coarser;
  per_a_m_ = (vertices_[1] - vertices_[0]) / units_,
  per_b_m_ = (vertices_[2] - vertices_[0]) / units_;
}

// Projects the part into every camera. Returns free if the cameras that are culled certify it, some
// if a camera that is not culled has no map, and all otherwise.
TriangleWalk::Maps TriangleWalk::set_maps() {
  const bool seen = rule_.hull.limits == hull::Limits::seen;
  maps_.clear();
  rule_.unmapped = 0;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    TriangleMap map;
    const ProjectionStatus status =
        triangle_map(cameras_[i].pixel_from_world, query_->hull().cameras()[i].skip_map, vertices_,
                     units_, map, seen ? &cameras_[i].image : nullptr);
    if (status == ProjectionStatus::culled && !seen) return Maps::free;
    if (status == ProjectionStatus::in_front) maps_.push_back(map);
    rule_.unmapped += status == ProjectionStatus::uncertain;
  }
  if (seen && int(maps_.size()) + rule_.unmapped < rule_.hull.min_seen) return Maps::free;
  return rule_.unmapped > 0 ? Maps::some : Maps::all;
}

// Sets cells_ to the whole part, divided evenly.
void TriangleWalk::begin_cells(int divisions) {
  cells_.clear();
  const double h = units_ / divisions;
  for (int j = 0; j < divisions; ++j)
    for (int i = 0; i + j < divisions; ++i) {
      cells_.add(float(i * h), float(j * h), 1);
      if (i + j + 1 < divisions) cells_.add(float((i + 1) * h), float((j + 1) * h), -1);
    }
}

// Sets cells_ to the quarters of the given cells: one at each corner, and an inverted one in the
// center.
void TriangleWalk::split_cells(const Cells& cells, double h) {
  const float half = float(0.5 * h);
  cells_.clear();
  cells_.reserve_more(4 * cells.count);
  for (std::size_t i = 0; i < cells.count; ++i) {
    const float a = cells.a[i], b = cells.b[i], sigma = cells.sigma[i], step = sigma * half;
    cells_.add(a, b, sigma);
    cells_.add(a + step, b, sigma);
    cells_.add(a, b + step, sigma);
    cells_.add(a + step, b + step, -sigma);
  }
}

// Samples the part at the requested spacing. Returns whether a sample is in the hull.
bool TriangleWalk::sample() {
  contact_.coarser |= coarser_;
  const double sample_h = units_ / divisions_;
  const std::size_t before = points_->size();
  begin_cells(start_);
  double h = units_ / start_;
  for (; h > kMaxSamplesPerEdge * sample_h && cells_.count > 0; h *= 0.5) {
    mixed_.clear(), solid_.clear();
    classify_cells(maps_, cells_, float(h), mixed_, solid_, rule_);
    if (is_clipped_)  // each sample is moved into the box
      for (std::size_t i = 0; i < solid_.count; ++i)
        mixed_.add(solid_.a[i], solid_.b[i], solid_.sigma[i]);
    else
      accept_solid(h, sample_h);
    split_cells(mixed_, h);
  }
  for (; h > sample_h; h *= 0.5) {
    std::swap(cells_, mixed_);
    split_cells(mixed_, h);
  }
  inside_.clear(), uncertain_.clear();
  classify_centers(maps_, cells_, float(h), inside_, uncertain_, rule_);
  accept_inside(h);
  return points_->size() > before;
}

// Tests one sample per coarse part: most colliding triangles have one in the hull.
bool TriangleWalk::coarse_test() {
  if (units_ < kCoarseDivisions) return false;
  begin_cells(kCoarseDivisions);
  inside_.clear(), uncertain_.clear();
  classify_centers(maps_, cells_, float(units_ / kCoarseDivisions), inside_, uncertain_, rule_);
  if (inside_.count > 0) add(center(inside_, 0, units_ / kCoarseDivisions));
  return inside_.count > 0;
}

// Splits the part until every cell is free or a point is found, then tests the rest in double.
CollisionVerdict TriangleWalk::decide() {
  begin_cells(1);
  for (double h = units_;; h *= 0.5) {
    mixed_.clear(), solid_.clear(), inside_.clear(), uncertain_.clear();
    classify_cells(maps_, cells_, float(h), mixed_, solid_, rule_);
    if (mixed_.count + solid_.count == 0) return CollisionVerdict::free;
    classify_centers(maps_, mixed_, float(h), inside_, uncertain_, rule_);
    if (solid_.count + inside_.count > 0) {
      add(center(solid_.count > 0 ? solid_ : inside_, 0, h));
      return CollisionVerdict::colliding;
    }
    contact_.cut_off |= mixed_.count > kMaxCells;
    if (h <= 1 || contact_.cut_off) return resolve_exact(h);
    split_cells(mixed_, h);
  }
}

// Tests the remaining mixed parts in double.
CollisionVerdict TriangleWalk::resolve_exact(double h) {
  contact_.cut_off |= mixed_.count > kMaxExactTests;
  for (std::size_t i = 0; i < std::min(mixed_.count, kMaxExactTests); ++i) {
    const double a = mixed_.a[i], b = mixed_.b[i], step = mixed_.sigma[i] * h;
    for (const Vector3d& p :
         {point(a, b), point(a + step, b), point(a, b + step), center(mixed_, i, h)}) {
      ++contact_.points_in_double;
      if (!query_->contains(p)) continue;
      add(p);
      return CollisionVerdict::colliding;
    }
  }
  return CollisionVerdict::undecided;
}

// Accepts the cells whose center is in the hull; double decides the uncertain ones.
void TriangleWalk::accept_inside(double h) {
  // The loop inlines center() and add(), because there are many samples.
  const Vector3d origin = vertices_[0], per_a_m = per_a_m_, per_b_m = per_b_m_,
                 reference = request_.farthest_from_world_m;
  const std::span<Vector3d> to =
      inside_.count > 0 ? points_->add(inside_.count) : std::span<Vector3d>();
  double farthest_m2 = -1;
  std::size_t farthest = 0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    const double third = inside_.sigma[i] * h / 3;
    const Vector3d p =
        in_box(origin + (inside_.a[i] + third) * per_a_m + (inside_.b[i] + third) * per_b_m);
    const double m2 = (p - reference).squaredNorm();
    if (m2 > farthest_m2) farthest_m2 = m2, farthest = i;
    to[i] = p;
  }
  if (!to.empty()) consider(to[farthest]);
  for (std::size_t i = 0; i < uncertain_.count; ++i) {
    const Vector3d p = center(uncertain_, i, h);
    ++contact_.points_in_double;
    if (query_->contains(p)) add(p);
  }
}

// Accepts every sample of the solid cells. One corner of a cell is farther from the reference point
// than all samples of the cell.
void TriangleWalk::accept_solid(double h, double sample_h) {
  const int rows = int(std::lround(h / sample_h));
  for (std::size_t i = 0; i < solid_.count; ++i) {
    const double a = solid_.a[i], b = solid_.b[i], step = solid_.sigma[i] * sample_h;
    // `between` leads from a part's center to that of its neighbour.
    const Vector3d to_next = step * per_a_m_, between = (to_next + step * per_b_m_) / 3;
    points_->add(SampledPart{vertices_[0] + (a + step / 3) * per_a_m_, per_b_m_, b, step, to_next,
                             between, rows});
    for (const Vector3d& corner :
         {point(a, b), point(a + rows * step, b), point(a, b + rows * step)})
      consider(corner);
  }
}

Vector3d TriangleWalk::point(double a, double b) const {
  return vertices_[0] + a * per_a_m_ + b * per_b_m_;
}

Vector3d TriangleWalk::center(const Cells& cells, std::size_t i, double h) const {
  const double third = cells.sigma[i] * h / 3;
  return point(cells.a[i] + third, cells.b[i] + third);
}

// Rounding may put a point of a clipped triangle outside the box.
Vector3d TriangleWalk::in_box(const Vector3d& p_world_m) const {
  if (!is_clipped_) return p_world_m;
  const Eigen::AlignedBox3d& box = rule_.hull.within_world_m;
  return p_world_m.cwiseMax(box.min()).cwiseMin(box.max());
}

void TriangleWalk::add(const Vector3d& p_world_m) {
  const Vector3d p = in_box(p_world_m);
  points_->add(p);
  consider(p);
}

// Keeps the point if it is the farthest from the reference point so far.
void TriangleWalk::consider(const Vector3d& p_world_m) {
  const double m2 = (p_world_m - request_.farthest_from_world_m).squaredNorm();
  if (!(m2 > farthest_m2_)) return;
  farthest_m2_ = m2;
  farthest_world_m_ = p_world_m;
}

}  // namespace fivepipe::collision
