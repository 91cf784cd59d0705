// Queries of points, balls, segments and rays against the hull of one frame set.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/image_cone.h"

namespace fivepipe::hull {

// Returns the ray from a (parameter 0) to b (parameter 1).
inline geometry::Ray segment(const Eigen::Vector3d& a_world_m, const Eigen::Vector3d& b_world_m) {
  return {a_world_m, b_world_m - a_world_m};
}

// Answers queries against a CpuHull. The hull must outlive the query, and CpuHull::assign() must
// not be called in between. The constructor creates all skip maps; after that the hull does not
// change. Several threads may query single points or rays concurrently. Queries of many points use
// the hull's pool: run one at a time, and not concurrently with CpuHull::depth().
class HullQuery {
 public:
  explicit HullQuery(CpuHull& hull);

  // Returns the same value as in_hull().
  bool contains(const Eigen::Vector3d& p_world_m) const;

  // Returns a radius such that no point nearer to p is in the hull: a lower bound of the distance
  // to the hull. 0 if p is in the hull, on its border within rounding, or not finite, or if a
  // camera is not finite. Infinity if the hull is empty. The bound of one camera is the larger of
  // the distances to the pyramid of its object pixels' bounds and to the border of the uniform box
  // around p's pixel, which extends at most 65 px.
  double free_radius_m(const Eigen::Vector3d& p_world_m) const;
  // Returns a radius such that every point nearer to p is in the hull. 0 if p is outside, on the
  // border within rounding, or not finite.
  double solid_radius_m(const Eigen::Vector3d& p_world_m) const;

  // Returns the intervals in which the ray is in the hull between the parameters near and far. They
  // are ascending, disjoint, not adjacent and not of length zero. The direction need not be
  // normalised; parameters are in units of its length. Exact to rounding, except that a ray that
  // stays on a border between pixels (within rounding) may count as on either side, and that the
  // first kNearestToCamera_m in front of a camera are not in the hull. Returns no interval if the
  // ray, near or far is not finite.
  std::vector<Interval> intervals(const geometry::Ray& ray, double near, double far) const;
  // Returns the start of the first interval, or nullopt.
  std::optional<double> first_entry(const geometry::Ray& ray, double near, double far) const;

  // Tests many points as contains() does, in the hull's pool. Writes 0 or 1 per point to `inside`,
  // which must have the same size. The result does not depend on the number of threads.
  void contains(std::span<const Eigen::Vector3d> p_world_m, std::span<std::uint8_t> inside) const;

  const CpuHull& hull() const { return *hull_; }

 private:
  struct CameraClearance;
  CameraClearance camera_clearance(std::size_t camera, const Eigen::Vector3d& p_world_m) const;
  template <class Take>
  void each_interval(const geometry::Ray& ray, double near, double far, const Take& take) const;

  CpuHull* hull_;
  struct Cones {
    ImageCone cone;
    Pyramid object, image;  // of the object pixels' bounds (if not empty) and of the image
  };
  std::vector<Cones> cones_;  // in the order of hull_->cameras()
};

}  // namespace fivepipe::hull
