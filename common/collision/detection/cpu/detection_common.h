// Functions that the certified backends `cpu` and `gl` share.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "common/collision/detection/cpu/contact_simd.h"
#include "common/collision/detection/cpu/cpu_detection.h"

namespace fivepipe::collision {

// Throws std::invalid_argument under the conditions of CpuDetection::detect().
void check_arguments(std::span<const DetectionObject> objects, const DetectionOptions& options);

// The rule's box in the coordinates of a tree.
struct BoxInTree {
  Eigen::AlignedBox3d box_world_m;
  Eigen::Isometry3d world_from_tree;  // from points relative to the tree's origin
  double rounding_m;
  // Returns true only if the box [tree] has no point in the rule's box.
  bool is_outside(const Eigen::Vector3d& center_m, const Eigen::Vector3d& half_m) const;
};

// An object's projection into the cameras of the hull, except those in which it is too large for
// float; rule.unmapped counts these.
struct ObjectMaps {
  std::vector<ObjectMap> maps;
  ContactRule rule;
  // Set if a part of the object may be outside the rule's box.
  std::optional<BoxInTree> box;

  // As classify_boxes(): boxes outside the rule's box are free too.
  std::uint32_t free_boxes(const Bvh::Boxes& boxes) const;
};
ObjectMaps object_maps(const hull::HullQuery& query, const DetectionObject& object);
// Returns true only if the whole object is in the rule's box.
bool is_in_rule_box(const hull::HullRule& rule, const DetectionObject& object);

// Returns whether the tree's bounding box, divided into cells of an eighth of its edges, has a cell
// that is not certified free.
bool may_hold_hull(const ObjectMaps& object, const Bvh& tree);

// Returns the number of points above which an object is sampled again at twice the spacing.
// triangles: number of the object's triangles.
std::size_t max_points_found(const DetectionOptions& options, std::size_t triangles);

// Reduces `points` to max_points, evenly spread, and keeps the point farthest from the reference
// point. Returns whether `points` had more.
bool subsample(std::vector<CollisionPoint>& points, const Eigen::Vector3d& rp_object_world_m,
               std::size_t max_points);

}  // namespace fivepipe::collision
