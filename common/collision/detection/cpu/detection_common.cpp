#include "common/collision/detection/cpu/detection_common.h"

#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Cells per edge of a bounding box, and the relative enlargement of a cell that covers the rounding
// of its center to float.
constexpr int kBoxCells = 8;
constexpr double kCellSlack = 1e-6;
static_assert(kBoxCells * kBoxCells % Bvh::kArity == 0);
// Maximum number of points of a triangle at the largest spacing: a center, a corner, and another of
// each for rounding.
constexpr std::size_t kMaxFoundPerTriangle = 4;

}  // namespace

void check_arguments(std::span<const DetectionObject> objects, const DetectionOptions& options) {
  if (!(options.eps_m >= kMinEps_m && std::isfinite(options.eps_m)))
    throw std::invalid_argument("eps_m is not finite or below 1e-6 m");
  if (!(options.spacing_m >= 0 && std::isfinite(options.spacing_m)))
    throw std::invalid_argument("spacing_m is negative or not finite");
  if (options.max_points == 0)
    throw std::invalid_argument("max_points is 0; use spacing_m 0 for the verdict alone");
  for (const DetectionObject& o : objects)
    if (!o.world_from_object.matrix().allFinite() || !o.rp_object_world_m.allFinite())
      throw std::invalid_argument("the pose or the reference point of an object is not finite");
}

bool BoxInTree::is_outside(const Vector3d& center_m, const Vector3d& half_m) const {
  const Vector3d center_world_m = world_from_tree * center_m,
                 half_world_m =
                     world_from_tree.linear().cwiseAbs() * half_m + Vector3d::Constant(rounding_m);
  return !box_world_m.intersects(
      Eigen::AlignedBox3d(center_world_m - half_world_m, center_world_m + half_world_m));
}

std::uint32_t ObjectMaps::free_boxes(const Bvh::Boxes& boxes) const {
  std::uint32_t free = classify_boxes(maps, boxes, rule).free;
  if (!box) return free;
  for (std::uint32_t left = ~free & ((1u << Bvh::kArity) - 1); left; left &= left - 1) {
    const auto i = std::size_t(std::countr_zero(left));
    if (box->is_outside(Vector3d(boxes.center_m[0][i], boxes.center_m[1][i], boxes.center_m[2][i]),
                        Vector3d(boxes.half_m[0][i], boxes.half_m[1][i], boxes.half_m[2][i])))
      free |= 1u << i;
  }
  return free;
}

bool is_in_rule_box(const hull::HullRule& rule, const DetectionObject& object) {
  if (!rule.is_bounded()) return true;
  const Vector3d center_m = object.world_from_object * object.tree->origin_m();
  const double radius_m =
      object.tree->radius_m() * (1 + kCellSlack) + kCellSlack * center_m.cwiseAbs().maxCoeff();
  return rule.within_world_m.contains(
      Eigen::AlignedBox3d(center_m.array() - radius_m, center_m.array() + radius_m));
}

ObjectMaps object_maps(const hull::HullQuery& query, const DetectionObject& object) {
  ObjectMaps made{{}, {query.hull().rule()}, {}};
  Eigen::Isometry3d world_from_tree = object.world_from_object;
  world_from_tree.translation() = object.world_from_object * object.tree->origin_m();
  if (!is_in_rule_box(made.rule.hull, object))
    made.box = {made.rule.hull.within_world_m, world_from_tree,
                kCellSlack * kCellSlack *
                    (object.tree->radius_m() + world_from_tree.translation().cwiseAbs().sum())};
  for (const hull::CpuHull::MapCamera& camera : query.hull().cameras())
    if (const auto map =
            object_map(camera, world_from_tree, object.tree->radius_m(), made.rule.hull.limits))
      made.maps.push_back(*map);
    else
      ++made.rule.unmapped;
  return made;
}

bool may_hold_hull(const ObjectMaps& object, const Bvh& tree) {
  if (object.rule.unmapped > 0 && object.rule.hull.limits == hull::Limits::all) return true;
  const Eigen::AlignedBox3d box = geometry::bounds_m(tree.mesh());
  const Vector3d half_m = box.sizes() / (2 * kBoxCells),
                 first_m = box.min() - tree.origin_m() + half_m;
  Bvh::Boxes cells;
  for (int i = 0; i < kBoxCells * kBoxCells * kBoxCells; ++i) {
    const int child = i % Bvh::kArity,
              cell[3] = {i % kBoxCells, i / kBoxCells % kBoxCells, i / (kBoxCells * kBoxCells)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cells.center_m[axis][std::size_t(child)] =
          float(first_m[Eigen::Index(axis)] + 2 * cell[axis] * half_m[Eigen::Index(axis)]);
      cells.half_m[axis][std::size_t(child)] =
          float(half_m[Eigen::Index(axis)] * (1 + kCellSlack) + kCellSlack * tree.radius_m());
    }
    if (child == Bvh::kArity - 1 && object.free_boxes(cells) != (1u << Bvh::kArity) - 1)
      return true;
  }
  return false;
}

std::size_t max_points_found(const DetectionOptions& options, std::size_t triangles) {
  if (!(options.spacing_m > 0)) return std::numeric_limits<std::size_t>::max();
  return options.max_points * kMaxFoundPerPoint + kMaxFoundPerTriangle * triangles;
}

bool subsample(std::vector<CollisionPoint>& points, const Vector3d& rp_object_world_m,
               std::size_t max_points) {
  const std::size_t count = points.size();
  if (count <= max_points) return false;
  const auto squared_m2 = [&](std::size_t i) {
    return (points[i].p_world_m - rp_object_world_m).squaredNorm();
  };
  std::size_t farthest = 0;
  for (std::size_t i = 0; i < count; ++i)
    if (squared_m2(i) > squared_m2(farthest)) farthest = i;
  for (std::size_t i = 0; i < max_points; ++i) {
    const std::size_t begin = i * count / max_points, end = (i + 1) * count / max_points;
    points[i] = points[begin <= farthest && farthest < end ? farthest : begin];
  }
  points.resize(max_points);
  return true;
}

}  // namespace fivepipe::collision
