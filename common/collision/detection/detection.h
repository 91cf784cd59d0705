// Entry point to collision detection: which triangles of virtual objects collide with the visual
// hull of one frame set, and where.
//
// The backends make detectors: cpu_detector() (cpu/cpu_detector.h), gl_detector()
// (gl/gl_detector.h) and paper_detector() (paper/paper_detector.h). Call set_hull() once per frame
// set, then detect().
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/hull.h"

namespace fivepipe::hull {
class HullQuery;
}

namespace fivepipe::collision {

class Bvh;

enum class CollisionVerdict {
  free,       // no point of it is in the hull: certified
  undecided,  // undecided: none of its points that were asked is in the hull, and it was not
              // certified free. What more is known, each backend says.
  colliding   // some of its points are in the hull: the collision points
};

// CP_i: a point of a triangle that lies in the hull, by in_hull().
struct CollisionPoint {
  Eigen::Vector3d p_world_m;
  std::uint32_t triangle;  // index into the object's triangles
  bool operator==(const CollisionPoint&) const = default;
};

struct ObjectCollision {
  CollisionVerdict verdict = CollisionVerdict::free;
  std::vector<std::uint32_t> triangles;  // those that collide; ascending
  std::vector<std::uint32_t>
      undecided;  // those that touch; ascending; where the backend tells them apart
  std::vector<CollisionPoint> points;  // CP_i, by triangle
  bool truncated = false;              // there were more points than asked for: some of them
  // No point of the surface collides, but a part of the hull may lie in the object's box: where the
  // object is closed, perhaps inside it.
  bool hull_in_box = false;
  bool colliding() const { return verdict == CollisionVerdict::colliding; }
};

struct DetectionOptions {
  double eps_m = 0.5e-3;    // >= kMinEps_m
  double spacing_m = 3e-3;  // at most, from a CP_i to the next on its triangle; 0: the verdict
                            // alone, with one CP_i a triangle
  std::size_t max_points =
      4096;  // of an object; of more, these are spread evenly over what was found. Where that is
             // more than kMaxFoundPerPoint times as many, samples are farther apart than asked for
};

struct DetectionObject {
  const Bvh* tree;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  Eigen::Vector3d rp_object_world_m =
      Eigen::Vector3d::Zero();  // the CP_i farthest from it is among the points, last of its
                                // triangle
};

inline constexpr double kMinEps_m = 1e-6;  // what maps resolve, by a thousand
inline constexpr std::size_t kMaxFoundPerPoint = 64;

struct DetectorCounts {  // sums
  std::size_t objects = 0, colliding = 0, undecided = 0;
  std::size_t points_unconfirmed = 0;  // paper: samples that OpenGL found in the hull and in_hull()
                                       // did not. gl: triangles for which that happened
};

class CollisionDetector {
 public:
  virtual ~CollisionDetector() = default;
  // The hull that is asked from now on, and the silhouettes that it is of. Both must stay until the
  // next.
  virtual void set_hull(const hull::HullQuery& query,
                        std::span<const hull::Silhouette> silhouettes) = 0;
  // One result per object, in the given order. The span belongs to the detector and is valid until
  // the next detect() or set_hull(); a caller may move results out of it. Requires a set hull.
  std::span<ObjectCollision> detect(std::span<const DetectionObject> objects);
  const DetectorCounts& counts() const { return counts_; }

 protected:
  virtual std::span<ObjectCollision> find(std::span<const DetectionObject> objects,
                                          DetectorCounts& counts) = 0;

 private:
  DetectorCounts counts_;
};

}  // namespace fivepipe::collision
