// What every backend says of a virtual object against the visual hull of one frame set.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace fivepipe {

enum class CollisionVerdict {
  free,       // no point of it is in the hull: certified
  touching,   // undecided: none of its points that were asked is in the hull, and it was not certified free. What more is known, each
              // backend says.
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
  std::vector<std::uint32_t> touching;   // those that touch; ascending; where the backend tells them apart
  std::vector<CollisionPoint> points;    // CP_i, by triangle
  bool truncated = false;                // there were more points than asked for: some of them
  // No point of the surface collides, but a part of the hull may lie in the object's box: where the object is closed, perhaps inside it.
  bool hull_in_box = false;
  bool colliding() const { return verdict == CollisionVerdict::colliding; }
};

}  // namespace fivepipe
