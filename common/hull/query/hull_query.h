// Volume queries for all users: points, balls, segments and rays against the hull of one frame set
// (design, "Balls" and "Rays").
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/image_cone.h"

namespace fivepipe::hull {

// The ray from a (parameter 0) to b (parameter 1).
inline geometry::Ray segment(const Eigen::Vector3d& a_world_m, const Eigen::Vector3d& b_world_m) {
  return {a_world_m, b_world_m - a_world_m};
}

// Borrows the hull, which must outlive it and not be assigned to meanwhile. Makes what its queries
// need, once; then it does not change. Queries of one point or ray may come from several threads at
// once; those of many share the hull's pool, one at a time with each other and with CpuHull::depth.
// Where the hull is empty because a camera is not finite, nothing is in it and all is free.
class HullQuery {
 public:
  explicit HullQuery(CpuHull& hull);

  // The very answer of in_hull().
  bool contains(const Eigen::Vector3d& p_world_m) const;

  // No point nearer to p than this is in the hull; infinity where there is no hull. 0 in the hull,
  // on its border to rounding, and for NaN. A lower bound of the distance to the hull: that to the
  // nearest border of boxes of pixels that are all alike, at most 65 px around.
  double free_radius_m(const Eigen::Vector3d& p_world_m) const;
  // Every point nearer to p than this is in the hull. 0 outside, on the border to rounding, and for
  // NaN.
  double solid_radius_m(const Eigen::Vector3d& p_world_m) const;

  // Where the ray is in the hull between the parameters near and far: ascending, disjoint, not
  // touching; none of length zero. The direction need not be normalised; parameters count in its
  // length. Exact to rounding; a ray that stays on a border between pixels (within rounding) may be
  // taken to be on either side, and the first kNearestToCamera_m before a camera are not in the
  // hull. Nothing where the ray, near or far is not finite.
  std::vector<Interval> intervals(const geometry::Ray& ray, double near, double far) const;
  // The first parameter of those.
  std::optional<double> first_entry(const geometry::Ray& ray, double near, double far) const;

  // The same of many, in the hull's pool; results are of the queries' size, and the same bits for
  // every number of threads.
  void contains(std::span<const Eigen::Vector3d> p_world_m,
                std::span<std::uint8_t> inside) const;  // 0 or 1
  void free_radius_m(std::span<const Eigen::Vector3d> p_world_m, std::span<double> radius_m) const;
  void solid_radius_m(std::span<const Eigen::Vector3d> p_world_m, std::span<double> radius_m) const;
  void first_entry(std::span<const geometry::Ray> rays, double near, double far,
                   std::span<double> entry) const;  // kNever where there is none

  const CpuHull& hull() const { return *hull_; }

 private:
  struct CameraClearance;  // what one camera says about the surroundings of a point
  CameraClearance camera_clearance(std::size_t camera, const Eigen::Vector3d& p_world_m) const;
  template <class Take>
  void each_interval(const geometry::Ray& ray, double near, double far, const Take& take) const;

  CpuHull* hull_;
  struct Cones {
    ImageCone cone;
    Pyramid object, image;  // of the object pixels' bounds, where there are any, and of the image
  };
  std::vector<Cones> cones_;  // as hull_->cameras()
};

}  // namespace fivepipe::hull
