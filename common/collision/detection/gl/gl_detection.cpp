#include "common/collision/detection/gl/gl_detection.h"

#include <algorithm>
#include <stdexcept>

#include "common/collision/detection/cpu/detection_common.h"
#include "common/collision/detection/gl/gl_detection_work.h"

namespace fivepipe::collision {

using namespace gl_contact;

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

// Tests the objects that do not fit the GPU with backend `cpu`.
void GlDetection::Work::detect_on_cpu(std::span<const DetectionObject> objects,
                                      const std::vector<char>& fits,
                                      const DetectionOptions& options) {
  std::vector<DetectionObject> remaining;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (!fits[i] && !objects[i].tree->empty()) remaining.push_back(objects[i]), index.push_back(i);
  if (remaining.empty()) return;
  const std::span<ObjectCollision> found = cpu.detect(*query, remaining, options);
  for (std::size_t i = 0; i < remaining.size(); ++i) collisions[index[i]] = std::move(found[i]);
  counts.objects_on_cpu = remaining.size();
}

// Descends the BVHs on the GPU and sorts the triangles that are not free into contacts.
void GlDetection::Work::open_contacts(std::span<const DetectionObject> objects) {
  std::vector<OpenTriangle> open = passes.open_triangles();
  counts.descent_ms = passes.descent_ms();
  counts.triangles_open = open.size();
  for (OpenTriangle& t : open) {
    const std::uint32_t place = t.place & ~kSolid;
    t.place = (t.place & kSolid) |
              objects[t.object].tree->triangles_of(int(place / Bvh::kArity))[place % Bvh::kArity];
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
    const geometry::Mesh& mesh = objects[t.object].tree->mesh();
    Triangle world;
    for (std::size_t k = 0; k < 3; ++k)
      world[k] = objects[t.object].world_from_object *
                 mesh.vertices_m[mesh.triangles[contact.triangle][k]];
    const std::array<std::size_t, 3> order = vertex_order(world);
    for (std::size_t k = 0; k < 3; ++k) contact.vertices_world_m[k] = world[order[k]];
    contacts.push_back(contact);
  }
}

// Decides all contacts. Returns false, with the spacing doubled, if an object exceeds its point
// limit.
bool GlDetection::Work::resolve_exact(std::span<const DetectionObject> objects,
                                      const DetectionOptions& options) {
  for (GlContact& c : contacts) {
    const double spacing_m = samplings[c.object].spacing_m;
    c.grid = triangle_grid(c.vertices_world_m, {options.eps_m, options.max_points}, spacing_m);
    c.sampling = spacing_m > 0;
  }
  refine();
  const std::vector<std::size_t> points = count_points();
  bool all = true;
  for (std::size_t i = 0; i < objects.size(); ++i)
    all &= !too_many_points(i, points[i], objects[i].tree->radius_m());
  if (!all) return false;
  add_candidates(objects);
  confirm(objects);
  return walk(objects, options, points);
}

// Sorts the decided contacts into the results of their objects.
void GlDetection::Work::gather(std::span<const DetectionObject> objects,
                               const DetectionOptions& options) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ResolvedContact& s = resolved[i];
    if (s.verdict == CollisionVerdict::free) continue;
    ObjectCollision& collision = collisions[contacts[i].object];
    (s.verdict == CollisionVerdict::colliding ? collision.triangles : collision.undecided)
        .push_back(contacts[i].triangle);
    collision.verdict = std::max(collision.verdict, s.verdict);
    collision.truncated |= s.coarser && s.points > 0;
    for (std::size_t k = 0; k < s.points; ++k)
      collision.points.push_back({points_world_m[s.first_point + k], contacts[i].triangle});
  }
  for (std::size_t i = 0; i < objects.size(); ++i)
    collisions[i].truncated |=
        subsample(collisions[i].points, objects[i].rp_object_world_m, options.max_points);
}

GlDetection::GlDetection(const GlDetectionRoom& room) : work_(std::make_unique<Work>(room)) {
  if (!(room.first > 0 && room.first <= room.max && room.first % kGroup == 0 &&
        room.max % kGroup == 0))
    throw std::invalid_argument(
        "room for parts: first and max must be multiples of 64 with 0 < first <= max");
}
GlDetection::~GlDetection() = default;

void GlDetection::set_hull(const hull::HullQuery& query) {
  work_->query = &query;
  // The shaders know only Limits::all; backend `cpu` decides all objects by Limits::seen.
  work_->maps_fit = query.hull().empty() || (query.hull().rule().limits == hull::Limits::all &&
                                             work_->passes.set_maps(query.hull()));
}

std::span<ObjectCollision> GlDetection::detect(std::span<const DetectionObject> objects,
                                               const DetectionOptions& options,
                                               GlDetectionCounts* counts) {
  Work& w = *work_;
  check_arguments(objects, options);
  w.clear(objects.size());
  if (!w.query->hull().empty()) {
    std::vector<char> fits(objects.size(), 0);
    if (w.maps_fit) fits = w.passes.set_objects(w.query->hull(), objects);
    w.detect_on_cpu(objects, fits, options);
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
      w.collisions[i].hull_in_box =
          may_hold_hull(object_maps(*w.query, objects[i]), *objects[i].tree);
    }
  }
  if (counts) *counts = w.counts;
  return w.collisions;
}

}  // namespace fivepipe::collision
