// Certified distance bounds from points and triangles of virtual objects to the visual hull, up to
// a cap (the paper's distance-field primitives). Uses: clearance maps, early warning, and fields
// such as a real hand that warms a virtual plate.
//
//        .---. cap        Branch and bound over cubes (lazy_octree.h). Cubes that one camera
//       /     \           certifies free are dropped; the others are split, nearest first. A cube
//      |   p   |  ____    with its centre in the hull gives a hull point, and steps from there
//       \  [][]/ /hull    towards p give a nearer one. The search ends when no remaining cube is
//        '-[][]-'         nearer than that point by more than the tolerance.
//             []
//
// The hull is an intersection of cones. HullQuery::free_radius_m() uses one cone at a time, so its
// lower bound is often several millimetres below min_m.
#pragma once
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/collision/detection/bvh.h"
#include "common/collision/detection/triangle.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// min_m <= distance <= max_m [m]. An unknown lower bound is 0, an unknown upper bound infinity.
//   {0, 0}                 in the hull: contains() confirms a point of it
//   {cap, infinity}        at least the cap away
//   {infinity, infinity}   the hull is empty
//   {0, infinity}          unknown: the input or a camera is not finite
struct Proximity {
  double min_m, max_m;
  bool operator==(const Proximity&) const = default;
};

struct ProximityOptions {
  double cap_m;        // finite, > 0
  double tolerance_m;  // > 0: largest max_m - min_m if the distance is below the cap
};

// One element per vertex and per triangle of a mesh.
struct MeshProximity {
  std::vector<Proximity> vertices, triangles;
};

// Searches the cubes around each point or triangle, nearest first. The results depend only on the
// hull, the options and the point or triangle, to the bit: not on other queries, their order or the
// number of threads.
class HullProximity {
 public:
  // Borrows the query, which must outlive this object. Keeps all tested cubes, so share one object
  // among all queries of a frame. Throws std::invalid_argument if the options are out of range.
  HullProximity(const hull::HullQuery& query, const ProximityOptions& options);
  ~HullProximity();

  // Computes one element of `proximity` per point, in the hull's worker pool. The spans have equal
  // sizes. Not thread-safe: make one call at a time.
  void of_points(std::span<const Eigen::Vector3d> p_world_m, std::span<Proximity> proximity);
  // Computes the distance of each triangle's nearest point. Accepts degenerate triangles. The
  // result does not depend on the order of a triangle's vertices.
  void of_triangles(std::span<const Triangle> triangles, std::span<Proximity> proximity);

  // Vertices: as of_points(). Triangles: the search starts from the vertices' bounds, so the result
  // may differ from of_triangles() within the tolerance.
  MeshProximity of_mesh(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_object);
  // The distance of the tree's nearest triangle, by branch and bound over its boxes. Triangles that
  // are not nearer than enough_m are not searched: {d, infinity} with d >= enough_m then means that
  // the distance is at least d. Runs in the calling thread.
  Proximity of_part(const Bvh& tree, const Eigen::Isometry3d& world_from_part,
                    double enough_m = std::numeric_limits<double>::infinity());

 private:
  struct Search;
  std::unique_ptr<Search> search_;
};

// Limits of the search for one point or piece of a triangle: the smallest cube as a fraction of the
// tolerance, and the number of opened cubes. If the hull is thinner than such a cube, or its
// borders meet in a needle's point, max_m - min_m stays above the tolerance.
inline constexpr double kFinestCube = 1.0 / 64;
inline constexpr int kMaxCubesOpened = 4096;

}  // namespace fivepipe::collision
