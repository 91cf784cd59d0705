// Distances that the renderer derives from the view and the scene.
#pragma once
#include "common/config/scene.h"
#include "common/geometry/camera.h"

namespace fivepipe::render {

// Returns the distance from the eye to the farthest corner of the near plane's visible part [m].
double near_corner_m(const geometry::Pinhole& pinhole, double near_m);

// Returns the distance at which the light has its nominal strength: that from the light to the
// center of the scene's bounding box [m].
double light_reach_m(const config::Scene& scene);

}  // namespace fivepipe::render
