// Distance to the hull's surface and its normal, for many points near it. Much faster than
// tangent_planes() (hull_border.h), and less accurate: 4 degrees on a ball of 25 px (median). It
// has no error bound: HullQuery decides whether a point is in the hull.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/hull.h"
#include "common/hull/silhouette/hull_distance_simd.h"

namespace fivepipe::hull {

struct SurfaceNearby {
  // Distance of the point from the plane that touches the hull; negative in the hull. Next to an
  // edge of the hull, the distance to the hull is larger.
  double distance_m;
  Eigen::Vector3d normal_world;  // unit, out of the hull
};

// The box of the rule bounds no surface here. With Limits::seen, the faces where fewer cameras see
// are no surfaces either, and the edge of an image that cuts an object is one.
class HullDistance {
 public:
  // Reads the silhouettes only in the constructor.
  explicit HullDistance(std::span<const Silhouette> silhouettes, const HullRule& rule = {});
  HullDistance(const HullDistance&) = delete;

  // Returns the surface of the camera whose silhouette's border limits the hull most at p. Returns
  // nullopt if the hull is empty, p is more than reach_m or kMaxOutside_px outside it, the rule
  // excludes p (outside its box, behind a camera, or seen by too few), p is not finite, or the
  // border's direction is undefined (in the middle of a part, or more than kMaxInside_px in it).
  std::optional<SurfaceNearby> near(const Eigen::Vector3d& p_world_m, double reach_m) const;
  // The same for many points; `surfaces` must have the same size.
  void near(std::span<const Eigen::Vector3d> p_world_m, double reach_m,
            std::span<std::optional<SurfaceNearby>> surfaces) const;

 private:
  struct DistanceCamera {
    geometry::Camera camera;
    Eigen::Vector3d center_world_m;
    BorderDistance distance;
  };
  std::optional<SurfaceNearby> surface_at(const LimitingBorder& border,
                                          const Eigen::Vector3d& p_world_m) const;

  HullRule rule_;
  std::vector<DistanceCamera> cameras_;
  std::vector<DistanceSimdCamera> simd_cameras_;  // in the same order; refer to cameras_
};

}  // namespace fivepipe::hull
