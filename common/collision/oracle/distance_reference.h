// Depth of a point in the visual hull, or its distance from it, exact to rounding. For tests and
// benchmarks. Computes in double and shares no code with the free and solid radii of HullQuery.
// Uses the hull rule Limits::all.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/hull.h"

namespace fivepipe::collision {

// Bounds of the distance to the hull; max_m is infinite if no hull point was found within the cap.
struct Clearance {
  double min_m, max_m;
};

// Borrows the silhouettes. The constructor builds summed-area tables of their object pixels; the
// object is immutable afterwards.
class HullDistance {
 public:
  explicit HullDistance(std::span<const hull::Silhouette> silhouettes);

  // Returns the minimum over the cameras of the signed distance [m] to the border of the camera's
  // visual cone: positive inside, negative outside, exact to rounding. Inside the hull it is the
  // exact distance to the hull's complement. Outside, the distance to the hull is at least the
  // negated result, and often larger. Between two points the result changes by at most their
  // distance. Returns minus infinity if there is no camera, a camera has no object pixel, or a
  // number is not finite.
  double signed_m(const Eigen::Vector3d& p_world_m) const;
  // Returns a radius such that no point nearer to p is in the hull: the smaller of max_m (>= 0) and
  // the negated signed_m(), but 0 in the hull. Returns 0 for a point that is not finite, and max_m
  // if there is no hull. Takes less than a microsecond for a point that one camera sees farther
  // than max_m from the bounds of its object pixels.
  double clear_m(const Eigen::Vector3d& p_world_m, double max_m) const;
  // Returns the distance from a hull point to the hull's complement; 0 outside the hull.
  double depth_m(const Eigen::Vector3d& p_world_m) const;
  // Returns certain bounds of the distance to the hull. They usually differ by at most tolerance_m
  // (> 0). They are farther apart if the nearest part of the hull, or a gap near it, is thinner
  // than that, or if the search reaches kMaxClearanceCells. Returns {cap_m, infinity} if the
  // distance is certainly above cap_m, {0, 0} inside the hull, and {0, infinity} for a point that
  // is not finite.
  Clearance clearance_m(const Eigen::Vector3d& p_world_m, double cap_m, double tolerance_m) const;

  std::span<const hull::Silhouette> silhouettes() const { return silhouettes_; }

 private:
  // One camera's rectangles of pixels as pyramids in space, with their apex at its center.
  struct Cone {
    explicit Cone(const hull::Silhouette& silhouette);

    const hull::Silhouette* silhouette;
    // The inverse, not the transpose: also valid for a rotation that is not quite orthonormal.
    Eigen::Matrix3d world_from_camera;
    Eigen::Vector3d center_world_m;
    // Number of object pixels left of u and above v, (width + 1) x (height + 1).
    std::vector<std::int32_t> objects_before;
    hull::PixelRect object_bounds;  // the smallest rectangle with every object pixel
    // Unit normals, in the world, of the planes through the center and the border before each
    // column or row; they point towards greater u or v.
    std::vector<Eigen::Vector3d> column_normals, row_normals;

    std::size_t count(const hull::PixelRect& rect) const;
    // Distance from the point, relative to the camera's center, to the closed pyramid of the
    // rectangle; 0 inside it.
    double to_pyramid_m(const Eigen::Vector3d& q_world_m, const hull::PixelRect& rect) const;
    // Distance to the nearest object pixel (`object`) or to the nearest other pixel; max_m if
    // that is farther.
    double to_pixels_m(const Eigen::Vector3d& q_world_m, bool object, double max_m) const;
    bool contains(const Eigen::Vector3d& p_world_m) const;
    // Depth of a point that projects to an object pixel.
    double depth_m(const Eigen::Vector3d& p_world_m, double max_m) const;
    // Distance of a point that does not project to an object pixel; max_m if that is farther.
    double distance_m(const Eigen::Vector3d& p_world_m, double max_m) const;
  };
  std::span<const hull::Silhouette> silhouettes_;
  std::vector<Cone> cones_;
  bool usable_ = false;
};

// Maximum number of cells of a clearance search, which then takes several seconds.
inline constexpr int kMaxClearanceCells = 100'000;

}  // namespace fivepipe::collision
