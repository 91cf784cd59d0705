// How deep a point lies in the hull, or how far from it, to rounding (design, "Triangles": depth
// and clearance). For tests and benchmarks; in double, shares no code with the balls of HullQuery.
// By the rule Limits::all.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/hull.h"

namespace fivepipe::collision {

// The distance to the hull lies between these; most_m is infinite where no hull point was found
// within the cap.
struct Clearance {
  double min_m, max_m;
};

// Borrows the silhouettes. Makes tables of their object pixels, once; then it does not change.
class HullDistance {
 public:
  explicit HullDistance(std::span<const hull::Silhouette> silhouettes);

  // The least over the cameras of the signed distance to what projects onto that camera's object
  // pixels: positive inside, negative outside, exact to rounding. Hence in the hull the exact
  // distance to the hull's complement; outside, the hull is at least as far as the negative of it,
  // and often farther. Changes by at most the distance between two points. Minus infinity where a
  // camera has no object pixel, there is no camera, or something is not finite.
  double signed_m(const Eigen::Vector3d& p_world_m) const;
  // Distance from a hull point to the hull's complement; 0 outside.
  double depth_m(const Eigen::Vector3d& p_world_m) const;
  // Bounds of the distance to the hull, right whatever they are. As a rule they lie tolerance_m (>
  // 0) apart or less; not so where the hull's nearest part, or a gap that looks like hull from
  // near, is thinner than that, or the search takes more than kMaxClearanceCells. {cap_m,
  // infinity} where it is certainly farther than cap_m; {0, 0} in the hull; {0, infinity}, nothing
  // known, for a point that is not finite.
  Clearance clearance_m(const Eigen::Vector3d& p_world_m, double cap_m, double tolerance_m) const;

  std::span<const hull::Silhouette> silhouettes() const { return silhouettes_; }

 private:
  // What one camera's rectangles of pixels cover in space: pyramids with their apex in its centre.
  struct Cone {
    explicit Cone(const hull::Silhouette& silhouette);

    const hull::Silhouette* silhouette;
    Eigen::Matrix3d world_from_camera;  // inverse, not transposed: a rotation that is not quite one
                                        // is taken as it is
    Eigen::Vector3d center_world_m;
    std::vector<std::int32_t>
        objects_before;  // object pixels left of u and above v, (width + 1) x (height + 1)
    // Unit normals, in the world, of the planes through the centre and the border before each
    // column, or row; to greater u, or v.
    std::vector<Eigen::Vector3d> column_normals, row_normals;

    std::size_t count(const hull::PixelRect& rect) const;
    // Distance from the point, seen from the camera's centre, to the rectangle's closed pyramid; 0
    // in it.
    double to_pyramid_m(const Eigen::Vector3d& q_world_m, const hull::PixelRect& rect) const;
    // To the nearest pixel that is an object pixel, or to the nearest of the image that is none;
    // at_most_m where that is farther.
    double to_pixels_m(const Eigen::Vector3d& q_world_m, bool object, double at_most_m) const;
    bool contains(const Eigen::Vector3d& p_world_m) const;
    double depth_m(const Eigen::Vector3d& p_world_m,
                   double at_most_m) const;                     // of a point on object pixels
    double distance_m(const Eigen::Vector3d& p_world_m) const;  // of one that is not
  };
  std::span<const hull::Silhouette> silhouettes_;
  std::vector<Cone> cones_;
  bool usable_ = false;
};

// Some seconds at worst.
inline constexpr int kMaxClearanceCells = 100'000;

}  // namespace fivepipe::collision
