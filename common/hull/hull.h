// The visual hull (paper, section 3.2): every point that projects onto an object pixel of every
// camera.
#pragma once
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// One camera's evidence: its object pixels have the size of its pinhole's image.
struct Silhouette {
  geometry::Camera camera;
  ObjectPixels pixels;
};

// Which cameras limit the hull at a point.
//   all:  every camera: what is behind one, or outside its image, is not in the hull (the paper's
//   rule, equation 1). seen: those that have the point in front of them and in their image; at
//   least min_seen of them.
enum class Limits { all, seen };
struct HullRule {
  Limits limits = Limits::all;
  int min_seen = 2;  // > 0; of `seen` alone
};

// In the hull: on an object pixel of every camera that limits it there. False where there is no
// camera, and for NaN. In double.
bool in_hull(std::span<const Silhouette> silhouettes, const Eigen::Vector3d& p_world_m,
             const HullRule& rule = {});

// Part of a ray: parameters [enter, leave), enter < leave.
struct Interval {
  double enter, leave;
  bool operator==(const Interval&) const = default;
};

// A view of the hull: where rays start and end as depth along the view's z [m], 0 < near < far.
struct View {
  geometry::Camera camera;
  double near_m = 0.05, far_m = 10.0;
};

// Depth along the view's z [m] of the first hull point on the ray through each pixel centre of
// `rect`, row-major; kNoHull where the ray meets none between near and far. near_m itself where the
// eye, or the near plane, is inside the hull.
struct DepthTile {
  PixelRect rect;
  std::vector<float> depth_m;
};
inline constexpr float kNoHull = 0.0f;

}  // namespace fivepipe::hull
