#include "common/collision/detection/paper/paper_detection.h"

#include <stdexcept>

#include "common/collision/detection/box_query.h"

namespace fivepipe::collision {
namespace {

enum class Stage { free_by_image, box_colliding, free_by_cells, box_may_hold };

Eigen::AlignedBox3d world_box_m(std::span<const Triangle> triangles) {
  Eigen::AlignedBox3d box;
  for (const Triangle& triangle : triangles)
    for (const Eigen::Vector3d& v : triangle) {
      if (!v.allFinite()) throw std::invalid_argument("a vertex of an object is not finite");
      box.extend(v);
    }
  return box;
}

std::vector<Triangle> faces_of(const Eigen::AlignedBox3d& box_world_m) {
  Eigen::Isometry3d world_from_box = Eigen::Isometry3d::Identity();
  world_from_box.translation() = box_world_m.center();
  return world_triangles(geometry::box_mesh(box_world_m.sizes()), world_from_box);
}

// The triangles of several objects in one batch, with their origin.
struct Batch {
  std::vector<Triangle> triangles;
  std::vector<std::size_t> object;       // object of each triangle
  std::vector<std::uint32_t> own_index;  // index of each triangle in its object

  void add(std::size_t owner, std::span<const Triangle> added) {
    for (std::size_t i = 0; i < added.size(); ++i) {
      triangles.push_back(added[i]);
      object.push_back(owner);
      own_index.push_back(std::uint32_t(i));
    }
  }
};

std::vector<Stage> stages_of(TriangleVolumeQuery& query,
                             std::span<const std::vector<Triangle>> objects_world_m) {
  std::vector<Stage> stages(objects_world_m.size(), Stage::free_by_image);
  std::vector<Eigen::AlignedBox3d> boxes_world_m;
  Batch faces;
  for (std::size_t i = 0; i < objects_world_m.size(); ++i) {
    boxes_world_m.push_back(world_box_m(objects_world_m[i]));
    if (objects_world_m[i].empty() ||
        is_certainly_free(query.silhouettes(), boxes_world_m[i], 0, query.rule()))
      continue;
    stages[i] = Stage::box_may_hold;
    faces.add(i, faces_of(boxes_world_m[i]));
  }
  for (const CollisionPoint& point : query.query(faces.triangles).points)
    stages[faces.object[point.triangle]] = Stage::box_colliding;
  for (std::size_t i = 0; i < stages.size(); ++i)
    if (stages[i] == Stage::box_may_hold &&
        is_certainly_free(query.silhouettes(), boxes_world_m[i], kCellDepth, query.rule()))
      stages[i] = Stage::free_by_cells;
  return stages;
}

}  // namespace

Detection detect(TriangleVolumeQuery& query,
                 std::span<const std::vector<Triangle>> objects_world_m) {
  const std::vector<Stage> stages = stages_of(query, objects_world_m);
  Detection detection{std::vector<ObjectCollision>(stages.size()), {.objects = stages.size()}};
  DetectionCounts& counts = detection.counts;
  Batch candidates;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    switch (stages[i]) {
      case Stage::free_by_image: ++counts.free_by_image; continue;
      case Stage::free_by_cells: ++counts.free_by_cells; continue;
      case Stage::box_colliding: ++counts.box_colliding; break;
      case Stage::box_may_hold: ++counts.box_may_hold; break;
    }
    detection.objects[i].verdict = CollisionVerdict::undecided;
    detection.objects[i].hull_in_box = true;
    candidates.add(i, objects_world_m[i]);
  }

  const TriangleQueryResult result = query.query(candidates.triangles);
  counts.triangles_queried = candidates.triangles.size();
  counts.points_unconfirmed = result.points_unconfirmed;
  for (const CollisionPoint& point : result.points) {
    ObjectCollision& object = detection.objects[candidates.object[point.triangle]];
    const std::uint32_t triangle = candidates.own_index[point.triangle];
    if (!object.colliding()) ++counts.colliding;
    object.verdict = CollisionVerdict::colliding;
    object.hull_in_box = false;
    if (object.triangles.empty() || object.triangles.back() != triangle)
      object.triangles.push_back(triangle);
    object.points.push_back({point.p_world_m, triangle});
  }
  return detection;
}

}  // namespace fivepipe::collision
