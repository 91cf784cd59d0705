#include "common/collision/detection/cpu/cpu_detection.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <iterator>
#include <limits>

#include "common/collision/detection/cpu/detection_common.h"
#include "common/collision/detection/cpu/triangle_walk.h"

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Leaves per task of the pool.
constexpr int kLeavesPerTask = 4;
// Triangles per task when points are written.
constexpr int kTrianglesPerTask = 16;

struct OpenLeaf {
  std::size_t object;
  int leaf;
};

// The results of one task: triangles that are not free, and their points.
struct Found {
  struct Triangle {
    std::size_t object;
    std::uint32_t triangle;
    CollisionVerdict verdict;
    bool coarser;
    std::size_t first_run, points;
  };
  std::vector<Triangle> triangles;
  ContactPoints points;
  CpuDetectionCounts counts;
};

struct ObjectQuery {
  const DetectionObject* object;
  ObjectMaps maps;
  double spacing_m;
  std::size_t point_limit;  // with more, the object is sampled again at twice the spacing
};

ObjectQuery object_query(const hull::HullQuery& query, const DetectionObject& object,
                         const DetectionOptions& options) {
  const std::size_t triangles = object.tree->mesh().triangles.size();
  return {&object, object_maps(query, object), options.spacing_m,
          max_points_found(options, triangles)};
}

// Appends the leaves that are not free, in order.
void open_leaves(const ObjectQuery& o, std::size_t number, std::vector<OpenLeaf>& leaves,
                 std::size_t& boxes) {
  struct Node {
    int level, index;
  };
  const Bvh& tree = *o.object->tree;
  std::vector<Node> open{{tree.levels() - 1, 0}};
  while (!open.empty()) {
    const Node node = open.back();
    open.pop_back();
    const Bvh::Boxes& children = tree.boxes(node.level, node.index);
    ++boxes;
    std::uint32_t left = ~o.maps.free_boxes(children) & ((1u << Bvh::kArity) - 1);
    if (node.level == 0) {
      for (; left; left &= left - 1)
        leaves.push_back({number, node.index * Bvh::kArity + std::countr_zero(left)});
    } else {
      for (; left; left &= ~std::bit_floor(left))
        open.push_back({node.level - 1, node.index * Bvh::kArity + int(std::bit_width(left)) - 1});
    }
  }
}

// Tests the triangles of a leaf until the object exceeds its point limit; `points` counts them.
void walk_leaf(const ObjectQuery& o, const OpenLeaf& open, std::atomic<std::size_t>& points,
               TriangleWalk& walk, Found& found) {
  const Bvh& tree = *o.object->tree;
  const auto triangles = tree.triangles_of(open.leaf);
  ContactBits bits =
      classify_leaf(o.maps.maps, tree.leaf(open.leaf), int(triangles.size()), o.maps.rule);
  if (o.maps.rule.unmapped > 0) bits.solid = 0;
  found.counts.triangles_classified += triangles.size();
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (bits.free >> i & 1) continue;
    if (points.load(std::memory_order_relaxed) > o.point_limit) return;
    Triangle world;
    for (std::size_t k = 0; k < 3; ++k)
      world[k] = o.object->world_from_object *
                 tree.mesh().vertices_m[tree.mesh().triangles[triangles[i]][k]];
    const std::size_t before = found.points.size();
    const TriangleContact contact = walk.walk(
        world, bits.solid >> i & 1, {o.spacing_m, o.object->rp_object_world_m}, found.points);
    const std::size_t count = found.points.size() - before;
    points.fetch_add(count, std::memory_order_relaxed);
    ++found.counts.triangles_walked;
    found.counts.points_in_double += contact.points_in_double;
    found.counts.over_budget += contact.cut_off;
    if (contact.verdict != CollisionVerdict::free)
      found.triangles.push_back({open.object, triangles[i], contact.verdict, contact.coarser,
                                 found.points.first_run(), count});
  }
}

using TriangleHit = std::pair<const Found*, const Found::Triangle*>;

// Gathers the points of one object, by triangle, from all tasks, and subsamples them.
void gather_points(base::WorkerPool& pool, std::span<const TriangleHit> triangles,
                   const DetectionObject& object, std::size_t max_points,
                   ObjectCollision& collision) {
  std::vector<CollisionPoint>& points = collision.points;
  std::size_t count = 0;
  std::vector<std::size_t> first;
  for (const auto& [found, t] : triangles) first.push_back(count), count += t->points;
  // Keeps the points of the previous call: the loop overwrites them, so they are not cleared first.
  points.resize(count);
  pool.run((int(triangles.size()) + kTrianglesPerTask - 1) / kTrianglesPerTask, [&](int task, int) {
    for (std::size_t i = std::size_t(task) * kTrianglesPerTask;
         i < std::min(triangles.size(), std::size_t(task + 1) * kTrianglesPerTask); ++i) {
      const auto& [found, t] = triangles[i];
      found->points.write(t->first_run, t->triangle, points.data() + first[i], t->points);
    }
  });
  collision.truncated |= subsample(points, object.rp_object_world_m, max_points);
}

}  // namespace

struct CpuDetection::Work {
  std::vector<ObjectQuery> objects;
  std::vector<OpenLeaf> leaves;
  std::vector<Found> found;
  std::vector<TriangleHit> triangles;
  std::vector<ObjectCollision> collisions;
  CpuDetectionCounts counts;

  void clear(std::size_t count) {
    objects.assign(count, {});
    collisions.resize(count);
    for (ObjectCollision& c : collisions) {
      c.verdict = CollisionVerdict::free;
      c.triangles.clear(), c.undecided.clear();
      c.truncated = c.hull_in_box = false;
    }
    leaves.clear();
    triangles.clear();
    counts = {};
  }
  bool walk_leaves(const hull::HullQuery& query, const DetectionOptions& options);
  void gather(base::WorkerPool& pool, std::span<const DetectionObject> requested,
              const DetectionOptions& options);
};

// Returns false, with the spacing doubled, if an object exceeds its point limit.
bool CpuDetection::Work::walk_leaves(const hull::HullQuery& query,
                                     const DetectionOptions& options) {
  base::WorkerPool& pool = query.hull().pool();
  const int tasks = (int(leaves.size()) + kLeavesPerTask - 1) / kLeavesPerTask;
  if (found.size() < std::size_t(tasks)) found.resize(std::size_t(tasks));
  for (Found& f : found) f.triangles.clear(), f.points.clear(), f.counts = {};
  std::vector<TriangleWalk> walks(std::size_t(pool.threads()),
                                  TriangleWalk(query, {options.eps_m, options.max_points}));
  std::vector<std::atomic<std::size_t>> points(objects.size());
  pool.run(tasks, [&](int task, int thread) {
    for (std::size_t i = std::size_t(task) * kLeavesPerTask;
         i < std::min(leaves.size(), std::size_t(task + 1) * kLeavesPerTask); ++i)
      walk_leaf(objects[leaves[i].object], leaves[i], points[leaves[i].object],
                walks[std::size_t(thread)], found[std::size_t(task)]);
  });
  bool all = true;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!(points[i] > objects[i].point_limit)) continue;
    objects[i].spacing_m *= 2;
    // A triangle that is cut may exceed the limit at any spacing; its points are kept.
    if (objects[i].spacing_m > 2 * objects[i].object->tree->radius_m())
      objects[i].point_limit = std::numeric_limits<std::size_t>::max();
    collisions[i].truncated = true;
    all = false;
  }
  return all;
}

void CpuDetection::Work::gather(base::WorkerPool& pool, std::span<const DetectionObject> requested,
                                const DetectionOptions& options) {
  for (const Found& f : found) {
    for (const Found::Triangle& t : f.triangles) triangles.emplace_back(&f, &t);
    counts.triangles_classified += f.counts.triangles_classified,
        counts.triangles_walked += f.counts.triangles_walked;
    counts.points_in_double += f.counts.points_in_double,
        counts.over_budget += f.counts.over_budget;
  }
  std::sort(triangles.begin(), triangles.end(), [](const TriangleHit& a, const TriangleHit& b) {
    return std::pair(a.second->object, a.second->triangle) <
           std::pair(b.second->object, b.second->triangle);
  });
  for (std::size_t object = 0, first = 0, last; object < requested.size(); ++object, first = last) {
    ObjectCollision& collision = collisions[object];
    for (last = first; last < triangles.size() && triangles[last].second->object == object;
         ++last) {
      const Found::Triangle& t = *triangles[last].second;
      (t.verdict == CollisionVerdict::colliding ? collision.triangles : collision.undecided)
          .push_back(t.triangle);
      collision.verdict = std::max(collision.verdict, t.verdict);
      collision.truncated |= t.coarser && t.points > 0;
    }
    gather_points(pool, std::span(triangles).subspan(first, last - first), requested[object],
                  options.max_points, collision);
  }
}

CpuDetection::CpuDetection() : work_(std::make_unique<Work>()) {}
CpuDetection::~CpuDetection() = default;

std::span<ObjectCollision> CpuDetection::detect(const hull::HullQuery& query,
                                                std::span<const DetectionObject> objects,
                                                const DetectionOptions& options,
                                                CpuDetectionCounts* counts) {
  check_arguments(objects, options);
  Work& w = *work_;
  w.clear(objects.size());
  if (query.hull().empty()) {
    for (ObjectCollision& c : w.collisions) c.points.clear();
  } else {
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (objects[i].tree->empty()) continue;
      w.objects[i] = object_query(query, objects[i], options);
      open_leaves(w.objects[i], i, w.leaves, w.counts.boxes);
    }
    while (!w.walk_leaves(query, options)) {
    }
    w.gather(query.hull().pool(), objects, options);
    for (std::size_t i = 0; i < objects.size(); ++i)
      if (!objects[i].tree->empty() && !w.collisions[i].colliding())
        w.collisions[i].hull_in_box = may_hold_hull(w.objects[i].maps, *objects[i].tree);
  }
  if (counts) *counts = w.counts;
  return w.collisions;
}

std::vector<ObjectCollision> detect(const hull::HullQuery& query,
                                    std::span<const DetectionObject> objects,
                                    const DetectionOptions& options, CpuDetectionCounts* counts) {
  CpuDetection detection;
  const std::span<ObjectCollision> found = detection.detect(query, objects, options, counts);
  return {std::make_move_iterator(found.begin()), std::make_move_iterator(found.end())};
}

}  // namespace fivepipe::collision
