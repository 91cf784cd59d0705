// The visual hull (paper, section 3.2): every point that projects onto an object pixel of every
// camera.
#pragma once
#include <Eigen/Geometry>
#include <limits>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// One camera and its object pixels, which have the size of the camera's image.
struct Silhouette {
  geometry::Camera camera;
  ObjectPixels pixels;
};

// Which cameras limit the hull at a point.
//   all:  every camera. A point behind a camera or outside its image is not in the hull (equation 1
//         of the paper).
//   seen: the cameras that see the point, which is in front of them and inside their image. At
//         least min_seen cameras must see it.
enum class Limits { all, seen };
struct HullRule {
  Limits limits = Limits::all;
  int min_seen = 2;  // > 0; only `seen` uses it
  // The hull is the part inside this closed box [m]; by default all of space.
  Eigen::AlignedBox3d within_world_m{Eigen::Vector3d::Constant(-kEverywhere_m),
                                     Eigen::Vector3d::Constant(kEverywhere_m)};
  static constexpr double kEverywhere_m = std::numeric_limits<double>::infinity();
  // Returns true if the box leaves out a part of space.
  bool is_bounded() const {
    return !(within_world_m.min().maxCoeff() == -kEverywhere_m &&
             within_world_m.max().minCoeff() == kEverywhere_m);
  }
};

// Returns true if p is in the rule's box and projects onto an object pixel of every camera that
// limits the hull there.
// Returns false if there is no camera or a coordinate is not finite. Computes in double.
bool in_hull(std::span<const Silhouette> silhouettes, const Eigen::Vector3d& p_world_m,
             const HullRule& rule = {});

// Part of a ray: the parameters [enter, leave), with enter < leave.
struct Interval {
  double enter, leave;
  bool operator==(const Interval&) const = default;
};

// A view of the hull. Its rays start at near_m and end at far_m, as depths along the view's z axis
// [m]; 0 < near_m < far_m.
struct View {
  geometry::Camera camera;
  double near_m = 0.05, far_m = 10.0;
};

// Depth along the view's z axis [m] of the first hull point on the ray through each pixel centre of
// `rect`, row-major. kNoHull if the ray meets no hull point between near_m and far_m. near_m if the
// ray is inside the hull at the near plane.
struct DepthTile {
  PixelRect rect;
  std::vector<float> depth_m;
};
inline constexpr float kNoHull = 0.0f;

}  // namespace fivepipe::hull
