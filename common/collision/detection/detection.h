// Entry point to collision detection: which triangles of virtual objects collide with the visual
// hull of one frame set, and at which points.
//
// A backend makes the detector: cpu_detector() (cpu/cpu_detector.h), gl_detector()
// (gl/gl_detector.h) or paper_detector() (paper/paper_detector.h). Call set_hull() once per frame
// set, then detect() for any number of objects. The verdicts mean:
//
//   free       certified by every backend: no point of the surface is in the hull
//   colliding  certified by every backend: at least one point of the surface, a collision point, is
//              in the hull
//   undecided  The backend proved neither. This is not contact.
//              cpu, gl: no tested point of the triangle is in the hull. A part of it in the hull,
//              if there is any, is thinner than eps_m, unless the triangle exceeded its budget of
//              parts (CpuDetectionCounts::over_budget).
//
//              paper: no sample of the object's surface is in the hull, but its box may contain
//              hull points.
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

// Ordered: the verdict of an object is the maximum of its triangles' verdicts.
enum class CollisionVerdict {
  free,       // certified: no point is in the hull
  undecided,  // neither certified free nor known to collide
  colliding   // at least one collision point is known
};

// Collision point CP_i of the paper: a point of a triangle for which hull::in_hull() is true.
struct CollisionPoint {
  Eigen::Vector3d p_world_m;
  std::uint32_t triangle;  // index into the object's triangles
  bool operator==(const CollisionPoint&) const = default;
};

// The result for one object.
struct ObjectCollision {
  CollisionVerdict verdict = CollisionVerdict::free;
  // Triangles of verdict colliding and undecided, as ascending indices. Backend `paper` decides
  // whole objects and leaves `undecided` empty.
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint32_t> undecided;
  // Collision points, by ascending triangle.
  std::vector<CollisionPoint> points;
  // `points` are a subset of the samples in the hull, or are farther apart than spacing_m.
  bool truncated = false;
  // The object does not collide, but its bounding box may contain a part of the hull. A closed
  // object may then enclose that part.
  bool hull_in_box = false;
  bool colliding() const { return verdict == CollisionVerdict::colliding; }
};

// Options of the backends `cpu` and `gl`.
struct DetectionOptions {
  // A part of a triangle in the hull that is at least this thick is found; finite, >= kMinEps_m.
  double eps_m = 0.5e-3;
  // Maximum distance between neighbouring collision points of a triangle; finite, >= 0. With 0 the
  // backend computes the verdict alone and returns one collision point per colliding triangle.
  double spacing_m = 3e-3;
  // Maximum number of collision points per object, > 0. A larger set is subsampled evenly, and the
  // point farthest from rp_object_world_m is kept. An object with more than kMaxFoundPerPoint times
  // as many points is sampled again at twice the spacing, so that memory stays bounded.
  std::size_t max_points = 4096;
};

struct DetectionObject {
  // Borrowed during detect(); not null.
  const Bvh* tree;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  // Reference point RP_object of the paper. The collision point farthest from it is always
  // returned, as the last of its triangle.
  Eigen::Vector3d rp_object_world_m = Eigen::Vector3d::Zero();
};

// Smallest eps_m: a thousandth of the maps' resolution at the working distance.
inline constexpr double kMinEps_m = 1e-6;
// Ratio of found to returned points above which an object is sampled again (max_points).
inline constexpr std::size_t kMaxFoundPerPoint = 64;

// Totals since the detector was made.
struct DetectorCounts {
  std::size_t objects = 0, colliding = 0, undecided = 0;
  // Points that OpenGL found in the hull and in_hull() did not confirm. paper: samples. gl:
  // triangles of which no point was confirmed.
  std::size_t points_unconfirmed = 0;
};

class CollisionDetector {
 public:
  virtual ~CollisionDetector() = default;
  // Sets the hull that detect() tests, and its silhouettes. The detector borrows both until the
  // next call of set_hull(). Throws std::invalid_argument if the backend does not support them.
  virtual void set_hull(const hull::HullQuery& query,
                        std::span<const hull::Silhouette> silhouettes) = 0;
  // Returns one result per object, in the given order. The span belongs to the detector and is
  // valid until the next detect() or set_hull(); a caller may move results out of it. Requires a
  // hull. Throws std::invalid_argument if a pose or a reference point is not finite, or an option
  // is out of range.
  std::span<ObjectCollision> detect(std::span<const DetectionObject> objects);
  const DetectorCounts& counts() const { return counts_; }

 protected:
  virtual std::span<ObjectCollision> find(std::span<const DetectionObject> objects,
                                          DetectorCounts& counts) = 0;

 private:
  DetectorCounts counts_;
};

}  // namespace fivepipe::collision
