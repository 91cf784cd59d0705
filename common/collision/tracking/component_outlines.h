// What each camera sees of a part of the hull: the convex outline of its object pixels. The planes
// through the camera's centre and the outline's sides touch the real object itself, not only its
// hull: they don't change with where the cameras don't look in.
#pragma once
#include <span>
#include <vector>

#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// Of one camera.
struct ComponentOutline {
  Eigen::Vector3d eye_world_m;
  std::vector<Eigen::Vector3d> corners_world;  // directions of the rays through the corners, pixel
                                               // centres; >= 3, not on one line
};

// By part, given as points in the hull, so many of each that none of the pieces that it has in an
// image is left out. A camera is missing where a piece is another part's, too, or reaches the
// image's border, or the pixels lie on one line.
std::vector<std::vector<ComponentOutline>> component_outlines(
    const hull::HullQuery& query, std::span<const std::vector<Eigen::Vector3d>> points_world_m);

}  // namespace fivepipe::collision
