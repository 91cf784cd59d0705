// Outlines of hull components: for each camera, the convex hull of a component's object pixels.
//
// The planes through the camera's centre and the outline's sides touch the real object itself, not
// only its hull. They do not depend on regions that the cameras cannot see.
#pragma once
#include <span>
#include <vector>

#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// Outline of one component in one camera.
struct ComponentOutline {
  Eigen::Vector3d eye_world_m;  // the camera's centre
  // Directions of the rays through the corners' pixel centres. At least 3, not collinear.
  std::vector<Eigen::Vector3d> corners_world;
};

// Returns the outlines of each component, one per camera. A component is given by points in the
// hull, dense enough to hit each of its connected pieces in every image. A camera is omitted for a
// component if one of its pieces also belongs to another component or reaches the image border, or
// if its pixels are collinear.
std::vector<std::vector<ComponentOutline>> component_outlines(
    const hull::HullQuery& query, std::span<const std::vector<Eigen::Vector3d>> points_world_m);

}  // namespace fivepipe::collision
