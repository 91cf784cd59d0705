#include "common/collision/proximity/lazy_octree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Relative bound on the rounding error of a projection, counted as in image_cone.cpp.
constexpr double kRoundings = 64 * std::numeric_limits<double>::epsilon();

// Octants that a thread allocates at once.
constexpr std::size_t kChunkSize = 256;

// Returns whether the rectangle has no object pixel. The rectangle must be inside the object's
// bounds. Steps from each pixel over the empty box ahead of it.
bool is_empty_rect(const hull::SkipMap& skip_map, const hull::PixelRect& rect) {
  for (int v = rect.v0_px; v < rect.v1_px;) {
    int rows = rect.v1_px - v;
    for (int u = rect.u0_px; u < rect.u1_px;) {
      const int r = skip_map.at(hull::Quadrant::right_down, u, v);
      if (r < 0) return false;
      rows = std::min(rows, r);
      u += r;
    }
    v += rows;
  }
  return true;
}

// How far a margin extends along a direction, times the length of that; below, along each axis of
// the world.
template <class Direction>
double beyond(const SweptMargin& margin, const Eigen::MatrixBase<Direction>& direction) {
  return std::abs(direction.dot(margin.sweep_world_m)) +
         margin.rounding_m * direction.cwiseAbs().sum();
}
Vector3d beyond_m(const SweptMargin& margin) {
  return margin.sweep_world_m.cwiseAbs() + Vector3d::Constant(margin.rounding_m);
}

// How far a body extends from its centre against and along a direction, times the direction's
// length; both are >= 0.
struct Span {
  double against, along;
};
struct CubeExtent {
  double half_edge_m;
  template <class Direction>
  Span operator()(const Eigen::MatrixBase<Direction>& direction) const {
    const double half = half_edge_m * direction.cwiseAbs().sum();
    return {half, half};
  }
  Vector3d half_m() const { return Vector3d::Constant(half_edge_m); }
  double sum_m() const { return 3 * half_edge_m; }
};
// A box with edges along the world's axes, and its margin.
struct SweptBoxExtent {
  Vector3d box_half_m;
  SweptMargin margin;
  template <class Direction>
  Span operator()(const Eigen::MatrixBase<Direction>& direction) const {
    const double half = direction.cwiseAbs().dot(box_half_m) + beyond(margin, direction);
    return {half, half};
  }
  Vector3d half_m() const { return box_half_m + beyond_m(margin); }
  double sum_m() const { return half_m().sum(); }
};
// A triangle, by its corners relative to its centroid, and its margin.
struct SweptTriangleExtent {
  Triangle from_center_m;
  SweptMargin margin;
  template <class Direction>
  Span operator()(const Eigen::MatrixBase<Direction>& direction) const {
    const double a = direction.dot(from_center_m[0]), b = direction.dot(from_center_m[1]),
                 c = direction.dot(from_center_m[2]), more = beyond(margin, direction);
    return {more - std::min({a, b, c, 0.0}), more + std::max({a, b, c, 0.0})};
  }
  Vector3d half_m() const {
    const auto& [a, b, c] = from_center_m;
    return a.cwiseAbs().cwiseMax(b.cwiseAbs()).cwiseMax(c.cwiseAbs()) + beyond_m(margin);
  }
  double sum_m() const { return half_m().sum(); }
};

// Returns the half-open range of pixels from low_px to high_px, clamped to [begin, end).
std::pair<int, int> pixels_between(double low_px, double high_px, int begin, int end) {
  const auto pixel = [&](double px) {
    return int(std::floor(std::clamp(px + 0.5, begin - 1.0, double(end))));
  };
  return {std::max(begin, pixel(low_px)), std::min(end, pixel(high_px) + 1)};
}

}  // namespace

struct CubeQuery::CubeProjection {
  bool sees_all = false;  // every point of the cube projects into the image
  bool may_hold = true;   // some point of the cube may project onto an object pixel
  bool center_seen = false, center_on = false;
};

CubeQuery::CubeQuery(const hull::HullQuery& query) : rule_(query.hull().rule()) {
  for (const hull::CpuHull::MapCamera& c : query.hull().cameras()) {
    const geometry::Pinhole& k = c.camera.pinhole;
    const Eigen::Matrix3d r = c.camera.camera_from_world.linear();
    const Vector3d t = c.camera.camera_from_world.translation();
    const double rounding =
        kRoundings * (2 + std::max(std::abs(k.cx_px) / k.fx_px, std::abs(k.cy_px) / k.fy_px));
    cameras_.push_back({r, t, k.fx_px, k.fy_px, k.cx_px, k.cy_px, rounding, t.cwiseAbs().sum(),
                        hull::image_of(c.camera), &c.skip_map});
  }
}

// Returns whether some point of the body around p may be in the pyramid of the object's bounds.
// Used for bodies that extend behind the camera. For a border b pixels from the principal point,
// the pyramid is the half-space fx X - b Z > 0 (or < 0).
template <class Extent>
bool CubeQuery::meets_pyramid(const CubeCamera& c, const Vector3d& p_camera_m, const Extent& extent,
                              double rounding_m) {
  const auto reaches = [&](int axis, double focal_px, double border_px, double side) {
    const Eigen::RowVector3d across = focal_px * c.r.row(axis) - border_px * c.r.row(2);
    const double at = focal_px * p_camera_m[axis] - border_px * p_camera_m.z();
    const Span span = extent(across);
    return side * at + (side > 0 ? span.along : span.against) +
               rounding_m * (focal_px + std::abs(border_px)) >=
           0;
  };
  const hull::PixelRect& object = c.skip_map->bounds();
  return reaches(0, c.fx_px, object.u0_px - 0.5 - c.cx_px, 1) &&
         reaches(0, c.fx_px, object.u1_px - 0.5 - c.cx_px, -1) &&
         reaches(1, c.fy_px, object.v0_px - 0.5 - c.cy_px, 1) &&
         reaches(1, c.fy_px, object.v1_px - 0.5 - c.cy_px, -1);
}

// A point at offset d from the centre projects, along u, at fx (r_x - x r_z) d / (Z + r_z d) from
// the centre's pixel, with x = X / Z. The extent along the row bounds this for all d in the body.
template <class Extent>
CubeQuery::CubeProjection CubeQuery::project(const CubeCamera& c, const Vector3d& center_world_m,
                                             const Extent& extent) {
  const Vector3d p = c.r * center_world_m + c.t;
  const double rounding_m =
      c.rounding * (center_world_m.cwiseAbs().sum() + extent.sum_m() + c.translation_m);
  const Span depth = extent(c.r.row(2));
  CubeProjection projection;
  if (!(p.z() + (depth.along + rounding_m) > 0)) {
    projection.may_hold = false;
    return projection;
  }
  const bool no_object = c.skip_map->bounds().empty();
  const double nearest_z = p.z() - (depth.against + rounding_m);
  if (no_object || !(nearest_z > 0)) {
    projection.may_hold = !no_object && meets_pyramid(c, p, extent, rounding_m);
    projection.center_seen = p.z() > 0 && hull::holds(c.image, c.fx_px * p.x() / p.z() + c.cx_px,
                                                      c.fy_px * p.y() / p.z() + c.cy_px);
    return projection;
  }
  const double x = p.x() / p.z(), y = p.y() / p.z(), per_nearest_z = 1 / nearest_z;
  const Span across = extent(c.r.row(0) - x * c.r.row(2)),
             down = extent(c.r.row(1) - y * c.r.row(2));
  const double u = c.fx_px * x + c.cx_px, v = c.fy_px * y + c.cy_px,
               rounding_x = rounding_m * (1 + std::abs(x)),
               rounding_y = rounding_m * (1 + std::abs(y)),
               low_u = u - c.fx_px * (across.against + rounding_x) * per_nearest_z,
               high_u = u + c.fx_px * (across.along + rounding_x) * per_nearest_z,
               low_v = v - c.fy_px * (down.against + rounding_y) * per_nearest_z,
               high_v = v + c.fy_px * (down.along + rounding_y) * per_nearest_z;
  const hull::PixelRect &image = c.image, &object = c.skip_map->bounds();
  projection.sees_all = low_u >= image.u0_px - 0.5 && high_u < image.u1_px - 0.5 &&
                        low_v >= image.v0_px - 0.5 && high_v < image.v1_px - 0.5;
  projection.center_seen = projection.sees_all || hull::holds(image, u, v);
  projection.center_on = hull::holds(object, u, v) &&
                         c.skip_map->at(hull::Quadrant::right_down, int(u + 0.5), int(v + 0.5)) < 0;
  if (projection.center_on) return projection;
  const auto [u0, u1] = pixels_between(low_u, high_u, object.u0_px, object.u1_px);
  const auto [v0, v1] = pixels_between(low_v, high_v, object.v0_px, object.v1_px);
  projection.may_hold = u0 < u1 && v0 < v1 && !is_empty_rect(*c.skip_map, {u0, v0, u1, v1});
  return projection;
}

CubeVerdict CubeQuery::test(const Vector3d& center_world_m, double half_edge_m) const {
  return verdict(center_world_m, CubeExtent{half_edge_m});
}

bool CubeQuery::is_free(const Vector3d& center_world_m, const Vector3d& half_m,
                        const SweptMargin& margin) const {
  return verdict(center_world_m, SweptBoxExtent{half_m, margin}).free;
}

bool CubeQuery::is_free(const Triangle& triangle_world_m, const SweptMargin& margin) const {
  const auto& [a, b, c] = triangle_world_m;
  const Vector3d center_m = (a + b + c) / 3;
  const Triangle from_center_m{a - center_m, b - center_m, c - center_m};
  return verdict(center_m, SweptTriangleExtent{from_center_m, margin}).free;
}

template <class Extent>
CubeVerdict CubeQuery::verdict(const Vector3d& center_world_m, const Extent& extent) const {
  const Vector3d half_m = extent.half_m();
  if (!rule_.within_world_m.intersects(
          Eigen::AlignedBox3d(center_world_m - half_m, center_world_m + half_m)))
    return {.free = true};
  const bool all = rule_.limits == hull::Limits::all;
  int may_hold = 0, center_on = 0;
  bool center_off = !rule_.within_world_m.contains(center_world_m);
  for (const CubeCamera& camera : cameras_) {
    const CubeProjection p = project(camera, center_world_m, extent);
    if (!p.may_hold && (all || p.sees_all)) return {.free = true};
    may_hold += p.may_hold;
    center_on += p.center_on;
    center_off |= !p.center_on && (all || p.center_seen);
  }
  const int needed = all ? int(cameras_.size()) : rule_.min_seen;
  if (may_hold < needed) return {.free = true};
  return {.free = false, .center_in_hull = !center_off && center_on >= needed};
}

LazyOctree::LazyOctree(const hull::HullQuery& query, double root_edge_m, int threads)
    : query_(query), root_edge_m_(root_edge_m), thread_states_(std::size_t(threads)) {}

std::size_t LazyOctree::CellIndexHash::operator()(const CellIndex& cell) const {
  std::uint64_t h = 0;
  for (const std::int64_t i : cell) h = (h ^ std::uint64_t(i)) * 0x9e3779b97f4a7c15u, h ^= h >> 29;
  return std::size_t(h);
}

const LazyOctree::Neighborhood& LazyOctree::neighborhood(const Vector3d& p_world_m, int thread) {
  ThreadState& state = thread_states_[std::size_t(thread)];
  CellIndex first;  // the cell with the lowest coordinates of the eight
  for (int axis = 0; axis < 3; ++axis)
    first[std::size_t(axis)] = std::int64_t(std::floor(p_world_m[axis] / root_edge_m_ - 0.5));
  if (state.last && state.last_cell == first) return *state.last;
  const auto [found, is_new] = state.neighborhoods.try_emplace(first);
  if (is_new) {
    const std::lock_guard lock(roots_mutex_);
    for (std::size_t i = 0; i < 8; ++i) {
      const CellIndex cell = {first[0] + std::int64_t(i & 1), first[1] + std::int64_t(i >> 1 & 1),
                              first[2] + std::int64_t(i >> 2)};
      const Vector3d center_world_m =
          root_edge_m_ *
          (Vector3d(double(cell[0]), double(cell[1]), double(cell[2])) + Vector3d::Constant(0.5));
      const auto [root, is_first] = root_at_.try_emplace(cell);
      if (is_first && !query_.test(center_world_m, root_edge_m_ / 2).free)
        root->second = std::make_unique<OctantsPtr>(nullptr);
      if (root->second) found->second.push_back({root->second.get(), center_world_m});
    }
  }
  state.last = &found->second;
  state.last_cell = first;
  return *state.last;
}

LazyOctree::Octants& LazyOctree::next_octants(ThreadState& state) {
  if (state.left == 0) {
    state.chunks.push_back(std::make_unique<Octants[]>(kChunkSize));
    state.left = kChunkSize;
  }
  return state.chunks.back()[kChunkSize - state.left];
}

LazyOctree::Octants& LazyOctree::octants(const Cube& cube, double half_edge_m, int thread) {
  if (Octants* existing = cube.octants->load(std::memory_order_acquire)) return *existing;
  ThreadState& state = thread_states_[std::size_t(thread)];
  Octants& made = next_octants(state);
  made.not_free = made.in_hull = 0;
  for (int i = 0; i < 8; ++i) {
    const CubeVerdict verdict =
        query_.test(center_of_octant(cube.center_world_m, half_edge_m, i), half_edge_m / 2);
    made.not_free = std::uint8_t(made.not_free | !verdict.free << i);
    made.in_hull = std::uint8_t(made.in_hull | verdict.center_in_hull << i);
  }
  Octants* first = nullptr;
  if (!cube.octants->compare_exchange_strong(first, &made, std::memory_order_acq_rel))
    return *first;  // another thread stored the same values first; ours are reused later
  --state.left;
  return made;
}

}  // namespace fivepipe::collision
