#include <algorithm>
#include <atomic>
#include <limits>

#include "common/collision/detection/cpu/triangle_walk.h"
#include "common/collision/detection/gl/gl_detection_work.h"

namespace fivepipe::collision {

using namespace gl_contact;
using Eigen::Vector3d;

namespace {

// Triangles per task of the pool.
constexpr std::size_t kTrianglesPerTask = 16;

// Factor that makes a conversion to float an upper bound.
constexpr double kRoundUp = 1 + 0x1p-22;

RefinedTriangle refined_triangle(const GlContact& contact, const Vector3d& origin_world_m) {
  RefinedTriangle t{};
  float* const vertices[] = {t.v0, t.v1, t.v2};
  double radius_m = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3d p = contact.vertices_world_m[k] - origin_world_m;
    radius_m = std::max(radius_m, p.norm());
    for (int axis = 0; axis < 3; ++axis) vertices[k][axis] = float(p[axis]);
  }
  t.radius_m = float(radius_m * kRoundUp);
  t.per_start = 1.0f / float(contact.grid.start);
  t.sampled = contact.sampled(), t.rows = contact.rows(), t.finest = contact.finest();
  return t;
}

// Appends the whole triangle as parts of level 0.
void add_first_parts(std::uint32_t triangle, int start, std::vector<Part>& parts) {
  for (int b = 0; b < start; ++b)
    for (int a = 0; a + b < start; ++a) {
      parts.push_back({triangle, std::uint32_t(a), std::uint32_t(b), 0});
      if (a + b + 1 < start)
        parts.push_back({triangle, std::uint32_t(a + 1) | kDown, std::uint32_t(b + 1), 0});
    }
}

// Value of refined_number for a contact that the GPU does not refine.
constexpr std::uint32_t kNotRefined = ~0u;

}  // namespace

// Refines the contacts on the GPU and grows the buffers for parts as needed. At the maximum it
// leaves all contacts to the CPU.
void GlDetection::Work::refine() {
  std::vector<RefinedTriangle> triangles;
  std::vector<Part> first;
  refined_number.assign(contacts.size(), kNotRefined);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const GlContact& c = contacts[i];
    if (c.solid || c.too_large()) continue;
    refined_number[i] = std::uint32_t(triangles.size());
    add_first_parts(refined_number[i], c.grid.start, first);
    triangles.push_back(refined_triangle(c, passes.origin_world_m()));
  }
  const std::size_t max_room = std::min(room.max, passes.max_room());
  for (refined = passes.refine(triangles, first, parts_room); !refined;
       refined = passes.refine(triangles, first, parts_room)) {
    ++counts.overflows;
    if (parts_room >= max_room) break;
    parts_room = std::min(2 * parts_room, max_room);
  }
  if (!refined) {
    refined.emplace();
    refined_number.assign(contacts.size(), kNotRefined);
    triangles.clear();
  }
  counts.parts += refined->parts, counts.found += refined->found.size();
  counts.refine_ms += passes.refine_ms();
  first_found.assign(triangles.size() + 1, 0);
  for (const Part& part : refined->found) ++first_found[part.triangle + 1];
  for (std::size_t i = 0; i < triangles.size(); ++i) first_found[i + 1] += first_found[i];
}

// Returns the parts found in a contact. Of the parts below the sample grid, which are sorted last,
// only the first is included: one point is enough if the grid has none.
std::span<const Part> GlDetection::Work::found_of(std::size_t contact) const {
  const std::uint32_t n = refined_number[contact];
  if (n == kNotRefined) return {};
  const std::span all =
      std::span(refined->found).subspan(first_found[n], first_found[n + 1] - first_found[n]);
  const int sampled = contacts[contact].sampled();
  const auto beyond = std::find_if(
      all.begin(), all.end(), [&](const Part& p) { return int(p.b >> kLevelShift) > sampled; });
  return all.first(std::size_t(beyond - all.begin()) + (beyond != all.end()));
}

// Returns the number of points that the GPU found, by object.
std::vector<std::size_t> GlDetection::Work::count_points() const {
  std::vector<std::size_t> points(samplings.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const GlContact& c = contacts[i];
    if (c.solid) points[c.object] += std::size_t(c.grid.divisions) * std::size_t(c.grid.divisions);
    for (const Part& part : found_of(i))
      points[c.object] += fivepipe::collision::count_points(c, part);
  }
  return points;
}

// Doubles the spacing of an object that exceeds its point limit, and returns whether it does.
bool GlDetection::Work::too_many_points(std::size_t object, std::size_t points, double radius_m) {
  Sampling& s = samplings[object];
  if (!(points > s.point_limit)) return false;
  s.spacing_m *= 2;
  // At a spacing beyond its size a triangle has one or two samples, which are kept.
  if (s.spacing_m > 2 * radius_m) s.point_limit = std::numeric_limits<std::size_t>::max();
  collisions[object].truncated = true;
  return true;
}

// Collects the points to confirm in double. For a triangle with solid parts, the last one is the
// corner of a solid part that is farthest from the reference.
void GlDetection::Work::add_candidates(std::span<const DetectionObject> objects) {
  points_world_m.clear();
  resolved.assign(contacts.size(), {});
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const GlContact& c = contacts[i];
    ResolvedContact& s = resolved[i];
    s.first_point = points_world_m.size();
    s.coarser = c.grid.coarser;
    double farthest_m2 = -1;
    Vector3d farthest_world_m;
    const auto consider = [&](const Vector3d& p) {
      const double m2 = (p - objects[c.object].rp_object_world_m).squaredNorm();
      if (m2 > farthest_m2) farthest_m2 = m2, farthest_world_m = p;
    };
    if (c.solid) {
      add_all_points(c, points_world_m);
      for (const Vector3d& v : c.vertices_world_m) consider(v);
    }
    for (const Part& part : found_of(i)) {
      add_points(c, part, points_world_m);
      if (part.found == kWholePartInHull && int(part.b >> kLevelShift) <= c.sampled())
        for (const Vector3d& corner : corners_world_m(c, part)) consider(corner);
    }
    if (c.sampling && farthest_m2 >= 0) points_world_m.push_back(farthest_world_m);
    s.points = points_world_m.size() - s.first_point;
  }
}

// Keeps the candidates that are in the hull, the farthest one last.
void GlDetection::Work::confirm(std::span<const DetectionObject> objects) {
  confirmed.resize(points_world_m.size());
  query->contains(points_world_m, confirmed);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const GlContact& c = contacts[i];
    ResolvedContact& s = resolved[i];
    const auto first = points_world_m.begin() + std::ptrdiff_t(s.first_point);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < s.points; ++k)
      if (confirmed[s.first_point + k]) first[std::ptrdiff_t(kept++)] = first[std::ptrdiff_t(k)];
    const State state = refined_number[i] == kNotRefined
                            ? State{c.solid ? 0 : kNever, c.solid ? kNever : 0}
                            : refined->states[refined_number[i]];
    const bool certain = state.found_pass != kNever;
    if (certain && kept == 0) ++counts.unconfirmed;
    s.walk = kept == 0 && (certain || state.deferred_pass != kNever);
    s.points = s.walk ? 0 : kept;
    if (s.points == 0) continue;
    s.verdict = CollisionVerdict::colliding;
    const auto m2 = [&](const Vector3d& p) {
      return (p - objects[c.object].rp_object_world_m).squaredNorm();
    };
    const auto last = first + std::ptrdiff_t(kept);
    const auto farthest = std::max_element(
        first, last, [&](const Vector3d& a, const Vector3d& b) { return m2(a) < m2(b); });
    if (c.sampling)
      std::rotate(farthest, farthest + 1, last);
    else
      s.points = 1;
  }
}

// Walks the triangles on the CPU that the GPU left open or that double did not confirm. Returns
// false in the same case as resolve_exact(). points_found: number of points by object, so far.
bool GlDetection::Work::walk(std::span<const DetectionObject> objects,
                             const DetectionOptions& options,
                             std::span<const std::size_t> points_found) {
  std::vector<std::size_t> deferred;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (resolved[i].walk) deferred.push_back(i);
  counts.triangles_on_cpu = deferred.size();
  base::WorkerPool& pool = query->hull().pool();
  const std::size_t tasks = (deferred.size() + kTrianglesPerTask - 1) / kTrianglesPerTask;
  walked.assign(tasks, {});
  std::vector<TriangleWalk> walks(std::size_t(pool.threads()),
                                  TriangleWalk(*query, {options.eps_m, options.max_points}));
  std::vector<std::atomic<std::size_t>> points(objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) points[i] = points_found[i];
  pool.run(int(tasks), [&](int task, int thread) {
    WalkedTriangles& to = walked[std::size_t(task)];
    for (std::size_t n = std::size_t(task) * kTrianglesPerTask;
         n < std::min(deferred.size(), std::size_t(task + 1) * kTrianglesPerTask); ++n) {
      const GlContact& c = contacts[deferred[n]];
      ResolvedContact& s = resolved[deferred[n]];
      if (points[c.object].load(std::memory_order_relaxed) > samplings[c.object].point_limit)
        continue;
      const std::size_t before = to.points.size();
      const TriangleContact contact = walks[std::size_t(thread)].walk(
          c.vertices_world_m, false,
          {samplings[c.object].spacing_m, objects[c.object].rp_object_world_m}, to.points);
      s.verdict = contact.verdict, s.coarser = contact.coarser;
      s.first_point = to.points.first_run(), s.points = to.points.size() - before;
      to.over_budget += contact.cut_off;
      points[c.object].fetch_add(s.points, std::memory_order_relaxed);
    }
  });
  bool all = true;
  for (std::size_t i = 0; i < objects.size(); ++i)
    all &= !too_many_points(i, points[i], objects[i].tree->radius_m());
  if (!all) return false;
  std::vector<CollisionPoint> points_of_one;
  // Appends the points to those of the other contacts.
  for (std::size_t n = 0; n < deferred.size(); ++n) {
    ResolvedContact& s = resolved[deferred[n]];
    points_of_one.resize(s.points);
    walked[n / kTrianglesPerTask].points.write(s.first_point, contacts[deferred[n]].triangle,
                                               points_of_one.data(), s.points);
    s.first_point = points_world_m.size();
    for (const CollisionPoint& p : points_of_one) points_world_m.push_back(p.p_world_m);
  }
  for (const WalkedTriangles& w : walked) counts.over_budget += w.over_budget;
  return true;
}

}  // namespace fivepipe::collision
