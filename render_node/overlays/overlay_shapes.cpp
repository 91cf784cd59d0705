#include "render_node/overlays/overlay_shapes.h"

#include <cassert>

namespace fivepipe::render {
namespace {

const Eigen::Vector3f kPoint(1, 1, 1), kRecovered(0.1f, 0.9f, 0.25f), kStillColliding(1, 0.55f, 0),
    kClosedForm(0, 0.85f, 1), kFourPoints(1, 0.25f, 1);
// The ends and the middle of the scale differ in lightness, too.
const Eigen::Vector3f kAtHull(0.85f, 0.1f, 0.1f), kHalfway(1, 0.9f, 0.3f),
    kAtCap(0.15f, 0.4f, 0.9f);

}  // namespace

Eigen::Vector3f proximity_rgb(float distance) {
  assert(distance >= 0 && distance <= 1);
  return distance < 0.5f ? kAtHull + 2 * distance * (kHalfway - kAtHull)
                         : kHalfway + (2 * distance - 1) * (kAtCap - kHalfway);
}

std::vector<Eigen::Vector3f> proximity_places_world_m(const OverlaidObject& object,
                                                      std::span<const Eigen::Vector3d> vertices_m,
                                                      const Eigen::Isometry3d& world_from_object) {
  std::vector<Eigen::Vector3f> places;
  places.reserve(object.proximity_values());
  if (object.proximity_of == config::ProximityOf::vertices) {
    for (const Eigen::Vector3d& v : vertices_m)
      places.push_back((world_from_object * v).cast<float>());
    return places;
  }
  for (const auto& [a, b, c] : object.mesh.triangles)
    places.push_back(
        (world_from_object * Eigen::Vector3d((vertices_m[a] + vertices_m[b] + vertices_m[c]) / 3))
            .cast<float>());
  return places;
}

void add_shapes(const CollisionMarks& marks, std::span<const Eigen::Vector3f> places_world_m,
                OverlayShapes& shapes) {
  for (const Eigen::Vector3f& p : marks.points_world_m) shapes.points.push_back({p, kPoint});
  if (marks.recovery) {
    const Eigen::Vector3f& rgb = marks.recovery->still_colliding ? kStillColliding : kRecovered;
    shapes.arrows.push_back(
        {marks.recovery->cp_object_world_m, marks.recovery->cp_hull_world_m, rgb});
    shapes.ends.push_back({marks.recovery->cp_hull_world_m.cast<float>(), rgb});
  }
  for (const HullNormalMark& normal : marks.hull_normals)
    shapes.arrows.push_back({normal.cp_hull_world_m,
                             normal.cp_hull_world_m + kNormalLength_m * normal.n_hull_world,
                             normal.is_closed_form ? kClosedForm : kFourPoints});
  assert(marks.proximity.empty() || marks.proximity.size() == places_world_m.size());
  for (std::size_t i = 0; i < marks.proximity.size(); ++i)
    if (marks.proximity[i] < 1)
      shapes.proximity.push_back({places_world_m[i], proximity_rgb(marks.proximity[i])});
}

}  // namespace fivepipe::render
