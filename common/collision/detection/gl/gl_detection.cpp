#include "common/collision/detection/gl/gl_detection.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>
#include <stdexcept>

#include "common/collision/detection/cpu/detection_common.h"
#include "common/collision/detection/cpu/triangle_walk.h"
#include "common/collision/detection/gl/gl_contact_passes.h"
#include "common/collision/detection/gl/gl_contact_points.h"

namespace fivepipe::collision {

using namespace gl_contact;
using Eigen::Vector3d;

namespace {

// Triangles per task of the pool.
constexpr std::size_t kTrianglesPerTask = 16;

// Factor that makes a conversion to float an upper bound.
constexpr double kRoundUp = 1 + 0x1p-22;

// The decision on a contact. Its points are consecutive, and each is in the hull.
struct ResolvedContact {
  CollisionVerdict verdict = CollisionVerdict::free;
  bool coarser = false, walk = false;  // walk: the CPU must walk the triangle
  std::size_t first_point = 0, points = 0;
};

struct Walked {  // results of one task
  ContactPoints points;
  std::size_t over_budget = 0;
};

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

}  // namespace

struct GlDetection::Work {
  explicit Work(const GlDetectionRoom& of) : room(of), parts_room(of.first) {}

  void clear(std::size_t count);
  void leave_to_cpu(std::span<const DetectionObject> of, const std::vector<char>& fits,
                    const DetectionOptions& options);
  void open_contacts(std::span<const DetectionObject> of);
  bool resolve_exact(std::span<const DetectionObject> of, const DetectionOptions& options);
  void refine();
  std::span<const Part> found_of(std::size_t contact) const;
  bool too_many_points(std::size_t object, std::size_t points, double radius_m);
  void add_candidates(std::span<const DetectionObject> of);
  void confirm(std::span<const DetectionObject> of);
  std::vector<std::size_t> count_points() const;
  bool walk(std::span<const DetectionObject> of, const DetectionOptions& options,
            std::span<const std::size_t> points_found);
  void gather(std::span<const DetectionObject> of, const DetectionOptions& options);

  GlContactPasses passes;
  CpuDetection cpu;
  const hull::HullQuery* query = nullptr;
  bool maps_fit = false;
  GlDetectionRoom room;
  std::size_t parts_room;

  struct Sampling {  // by object
    double spacing_m;
    std::size_t point_limit;  // with more, the object is sampled again at twice the spacing
  };
  std::vector<Sampling> samplings;
  std::vector<GlContact> contacts;            // by object, triangle
  std::vector<std::uint32_t> refined_number;  // index on the GPU, by contact
  std::optional<GlContactPasses::Refined> refined;
  std::vector<std::size_t> first_found;  // by triangle on the GPU, with an end
  std::vector<ResolvedContact> settled;  // by contact
  std::vector<Vector3d> points_world_m;
  std::vector<std::uint8_t> confirmed;
  std::vector<Walked> walked;
  std::vector<ObjectCollision> collisions;
  GlDetectionCounts counts;
};

constexpr std::uint32_t kNotRefined = ~0u;

void GlDetection::Work::clear(std::size_t count) {
  collisions.resize(count);
  for (ObjectCollision& c : collisions) {
    c.verdict = CollisionVerdict::free;
    c.triangles.clear(), c.undecided.clear(), c.points.clear();
    c.truncated = c.hull_in_box = false;
  }
  contacts.clear();
  counts = {};
}

void GlDetection::Work::leave_to_cpu(std::span<const DetectionObject> of,
                                     const std::vector<char>& fits,
                                     const DetectionOptions& options) {
  std::vector<DetectionObject> left;
  std::vector<std::size_t> number;
  for (std::size_t i = 0; i < of.size(); ++i)
    if (!fits[i] && !of[i].tree->empty()) left.push_back(of[i]), number.push_back(i);
  if (left.empty()) return;
  const std::span<ObjectCollision> found = cpu.detect(*query, left, options);
  for (std::size_t i = 0; i < left.size(); ++i) collisions[number[i]] = std::move(found[i]);
  counts.objects_on_cpu = left.size();
}

void GlDetection::Work::open_contacts(std::span<const DetectionObject> of) {
  std::vector<OpenTriangle> open = passes.open_triangles();
  counts.descent_ms = passes.descent_ms();
  counts.triangles_open = open.size();
  for (OpenTriangle& t : open) {
    const std::uint32_t place = t.place & ~kSolid;
    t.place = (t.place & kSolid) |
              of[t.object].tree->triangles_of(int(place / Bvh::kArity))[place % Bvh::kArity];
  }
  const auto key = [](const OpenTriangle& t) {
    return std::uint64_t{t.object} << 32 | (t.place & ~kSolid);
  };
  std::sort(open.begin(), open.end(),
            [&](const OpenTriangle& a, const OpenTriangle& b) { return key(a) < key(b); });
  contacts.reserve(open.size());
  for (const OpenTriangle& t : open) {
    GlContact contact{};
    contact.object = t.object, contact.triangle = t.place & ~kSolid,
    contact.solid = t.place & kSolid;
    const geometry::Mesh& mesh = of[t.object].tree->mesh();
    Triangle world;
    for (std::size_t k = 0; k < 3; ++k)
      world[k] =
          of[t.object].world_from_object * mesh.vertices_m[mesh.triangles[contact.triangle][k]];
    const std::array<std::size_t, 3> order = vertex_order(world);
    for (std::size_t k = 0; k < 3; ++k) contact.vertices_world_m[k] = world[order[k]];
    contacts.push_back(contact);
  }
}

// Returns false, with the spacing doubled, if an object exceeds its point limit.
bool GlDetection::Work::resolve_exact(std::span<const DetectionObject> of,
                                      const DetectionOptions& options) {
  for (GlContact& c : contacts) {
    const double spacing_m = samplings[c.object].spacing_m;
    c.grid = triangle_grid(c.vertices_world_m, {options.eps_m, options.max_points}, spacing_m);
    c.sampling = spacing_m > 0;
  }
  refine();
  const std::vector<std::size_t> points = count_points();
  bool all = true;
  for (std::size_t i = 0; i < of.size(); ++i)
    all &= !too_many_points(i, points[i], of[i].tree->radius_m());
  if (!all) return false;
  add_candidates(of);
  confirm(of);
  return walk(of, options, points);
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

bool GlDetection::Work::too_many_points(std::size_t object, std::size_t points, double radius_m) {
  Sampling& s = samplings[object];
  if (!(points > s.point_limit)) return false;
  s.spacing_m *= 2;
  // At a spacing beyond its size a triangle has one or two samples; they are kept.
  if (s.spacing_m > 2 * radius_m) s.point_limit = std::numeric_limits<std::size_t>::max();
  collisions[object].truncated = true;
  return true;
}

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

// Returns the parts found in a contact. Of the parts below the sample grid, which come last, only
// the first is included: one point is enough if the grid has none.
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

// Collects the points to confirm in double. For a triangle with solid parts, the last one is the
// corner of a solid part that is farthest from the reference.
void GlDetection::Work::add_candidates(std::span<const DetectionObject> of) {
  points_world_m.clear();
  settled.assign(contacts.size(), {});
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const GlContact& c = contacts[i];
    ResolvedContact& s = settled[i];
    s.first_point = points_world_m.size();
    s.coarser = c.grid.coarser;
    double farthest_m2 = -1;
    Vector3d farthest_world_m;
    const auto consider = [&](const Vector3d& p) {
      const double m2 = (p - of[c.object].rp_object_world_m).squaredNorm();
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
void GlDetection::Work::confirm(std::span<const DetectionObject> of) {
  confirmed.resize(points_world_m.size());
  query->contains(points_world_m, confirmed);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const GlContact& c = contacts[i];
    ResolvedContact& s = settled[i];
    const auto first = points_world_m.begin() + std::ptrdiff_t(s.first_point);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < s.points; ++k)
      if (confirmed[s.first_point + k]) first[std::ptrdiff_t(kept++)] = first[std::ptrdiff_t(k)];
    const State state = refined_number[i] == kNotRefined
                            ? State{c.solid ? 0 : kNever, c.solid ? kNever : 0}
                            : refined->states[refined_number[i]];
    const bool sure = state.found_pass != kNever;
    if (sure && kept == 0) ++counts.unconfirmed;
    s.walk = kept == 0 && (sure || state.left_pass != kNever);
    s.points = s.walk ? 0 : kept;
    if (s.points == 0) continue;
    s.verdict = CollisionVerdict::colliding;
    const auto m2 = [&](const Vector3d& p) {
      return (p - of[c.object].rp_object_world_m).squaredNorm();
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

// Walks the remaining triangles on the CPU. Returns as resolve_exact(); points_found: by object, so
// far.
bool GlDetection::Work::walk(std::span<const DetectionObject> of, const DetectionOptions& options,
                             std::span<const std::size_t> points_found) {
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (settled[i].walk) left.push_back(i);
  counts.triangles_on_cpu = left.size();
  base::WorkerPool& pool = query->hull().pool();
  const std::size_t tasks = (left.size() + kTrianglesPerTask - 1) / kTrianglesPerTask;
  walked.assign(tasks, {});
  std::vector<TriangleWalk> walks(std::size_t(pool.threads()),
                                  TriangleWalk(*query, {options.eps_m, options.max_points}));
  std::vector<std::atomic<std::size_t>> points(of.size());
  for (std::size_t i = 0; i < of.size(); ++i) points[i] = points_found[i];
  pool.run(int(tasks), [&](int task, int thread) {
    Walked& to = walked[std::size_t(task)];
    for (std::size_t n = std::size_t(task) * kTrianglesPerTask;
         n < std::min(left.size(), std::size_t(task + 1) * kTrianglesPerTask); ++n) {
      const GlContact& c = contacts[left[n]];
      ResolvedContact& s = settled[left[n]];
      if (points[c.object].load(std::memory_order_relaxed) > samplings[c.object].point_limit)
        continue;
      const std::size_t before = to.points.size();
      const TriangleContact contact = walks[std::size_t(thread)].walk(
          c.vertices_world_m, false,
          {samplings[c.object].spacing_m, of[c.object].rp_object_world_m}, to.points);
      s.verdict = contact.verdict, s.coarser = contact.coarser;
      s.first_point = to.points.first_run(), s.points = to.points.size() - before;
      to.over_budget += contact.cut_off;
      points[c.object].fetch_add(s.points, std::memory_order_relaxed);
    }
  });
  bool all = true;
  for (std::size_t i = 0; i < of.size(); ++i)
    all &= !too_many_points(i, points[i], of[i].tree->radius_m());
  if (!all) return false;
  std::vector<CollisionPoint> points_of_one;
  // Appends the points to those of the other contacts.
  for (std::size_t n = 0; n < left.size(); ++n) {
    ResolvedContact& s = settled[left[n]];
    points_of_one.resize(s.points);
    walked[n / kTrianglesPerTask].points.write(s.first_point, contacts[left[n]].triangle,
                                               points_of_one.data(), s.points);
    s.first_point = points_world_m.size();
    for (const CollisionPoint& p : points_of_one) points_world_m.push_back(p.p_world_m);
  }
  for (const Walked& w : walked) counts.over_budget += w.over_budget;
  return true;
}

void GlDetection::Work::gather(std::span<const DetectionObject> of,
                               const DetectionOptions& options) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ResolvedContact& s = settled[i];
    if (s.verdict == CollisionVerdict::free) continue;
    ObjectCollision& collision = collisions[contacts[i].object];
    (s.verdict == CollisionVerdict::colliding ? collision.triangles : collision.undecided)
        .push_back(contacts[i].triangle);
    collision.verdict = std::max(collision.verdict, s.verdict);
    collision.truncated |= s.coarser && s.points > 0;
    for (std::size_t k = 0; k < s.points; ++k)
      collision.points.push_back({points_world_m[s.first_point + k], contacts[i].triangle});
  }
  for (std::size_t i = 0; i < of.size(); ++i)
    collisions[i].truncated |=
        subsample(collisions[i].points, of[i].rp_object_world_m, options.max_points);
}

GlDetection::GlDetection(const GlDetectionRoom& room) : work_(std::make_unique<Work>(room)) {
  if (!(room.first > 0 && room.first <= room.max && room.first % kGroup == 0 &&
        room.max % kGroup == 0))
    throw std::invalid_argument(
        "room for parts: not multiples of 64, or the first is none, or more than the most");
}
GlDetection::~GlDetection() = default;
GlDetection::GlDetection(GlDetection&&) noexcept = default;
GlDetection& GlDetection::operator=(GlDetection&&) noexcept = default;

void GlDetection::set_hull(const hull::HullQuery& query) {
  work_->query = &query;
  work_->maps_fit = query.hull().empty() || work_->passes.set_maps(query.hull());
}

std::span<ObjectCollision> GlDetection::detect(std::span<const DetectionObject> objects,
                                               const DetectionOptions& options,
                                               GlDetectionCounts* counts) {
  Work& w = *work_;
  check_arguments(*w.query, objects, options);
  w.clear(objects.size());
  if (!w.query->hull().empty()) {
    std::vector<char> fits(objects.size(), 0);
    if (w.maps_fit) fits = w.passes.set_objects(w.query->hull(), objects);
    w.leave_to_cpu(objects, fits, options);
    if (w.maps_fit) w.open_contacts(objects);
    w.samplings.clear();
    for (const DetectionObject& o : objects)
      w.samplings.push_back(
          {options.spacing_m, max_points_found(options, o.tree->mesh().triangles.size())});
    while (!w.resolve_exact(objects, options)) {
    }
    w.gather(objects, options);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (!fits[i] || w.collisions[i].colliding()) continue;
      const std::vector<ObjectMap> maps = object_maps(*w.query, objects[i]);
      w.collisions[i].hull_in_box =
          maps.size() < w.query->hull().cameras().size() || may_hold_hull(maps, *objects[i].tree);
    }
  }
  if (counts) *counts = w.counts;
  return w.collisions;
}

}  // namespace fivepipe::collision
