// What the certified backends of the detection, `cpu` and `gl`, have in common.
#pragma once
#include <span>
#include <vector>

#include "common/collision/detection/cpu/contact_simd.h"
#include "common/collision/detection/cpu/cpu_detection.h"

namespace fivepipe::collision {

// Throws std::invalid_argument, as CpuDetection::detect says.
void check_arguments(const hull::HullQuery& query, std::span<const DetectionObject> objects,
                     const DetectionOptions& options);

// In the hull's cameras; fewer than they are where float has no room for the object.
std::vector<ObjectMap> object_maps(const hull::HullQuery& query, const DetectionObject& object);

// Some cell of the tree's box, of an eighth of its edges, may hold a part of the hull. Maps of all
// cameras.
bool may_hold_hull(std::span<const ObjectMap> maps, const Bvh& tree);

// More points of an object than that, and it is sampled anew, less finely.
std::size_t max_points_found(const DetectionOptions& options, std::size_t triangles);

// Where there are too many: spread evenly over them, with the farthest kept. True: there were.
bool subsample(std::vector<CollisionPoint>& points, const Eigen::Vector3d& rp_object_world_m,
               std::size_t max_points);

}  // namespace fivepipe::collision
