// How near the visual hull is: the distance from points and triangles of virtual objects to it, up
// to a cap, with certified bounds (the paper's distance-field primitives): clearance maps, early
// warning, fields such as a real hand that warms a virtual plate.
//
//        .---. cap        Branch and bound over cubes of space (proximity_cells.h). A cube that one
//        camera certifies free is left out; what
//       /     \           stays is split, the nearest first. A cube whose centre is in the hull
//       gives a hull point, and, stepping from it
//      |   p   |  ____    towards p, a nearer one. Done when no cube is left that is more than the
//      tolerance nearer than that point.
//       \  [][]/ /hull
//        '-[][]-'         The hull is an intersection of cones: HullQuery::free_radius_m, one
//        camera's word, ends 1 to
//             []          11 mm below least_m in the mean of the points below.
//
// Measured on one thread of a busy machine, the least of several runs, in CPU time: hand4 of the
// hull benchmark (four maps of 720x486), cap 5 cm, 10,000 points, cubes asked anew, microseconds a
// point:
//
//     tolerance [mm]                      5      2      0.5
//     a plate, 2 to 3 mm apart, over it   3.4    7.4    17      2.4, 9, 44 cubes asked a point
//     a sphere of 6 cm about the fingers  2.8    5.6    13      its 20,480 triangles (1.6 mm),
//     vertices included: 2.9, 6.2, 23 a triangle anywhere in the scene's box         4.6    9.2 32
//
// Asked again, over cubes already there: 10 to 60 % less. What else was tried: best first, by a
// heap over all cubes: as many cubes, 1.04 to 1.8 times the time. Depth first down to the finest at
// once: about as fast, 1.2 to 2.1 times the cubes asked, and on a few points it runs out of them.
// HullQuery::first_entry in place of steps towards p: 1 to 1.5 times the time. The true distance
// known beforehand would save a quarter to a third of the cubes opened: it is certifying that
// costs.
#pragma once
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/collision/detection/triangle.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// least_m <= distance <= most_m [m]. Where less was asked or is known than that, infinity is an
// upper bound and 0 a lower one.
//   {0, 0}                 in the hull: a point that contains() confirms
//   {cap, infinity}        at least the cap away
//   {infinity, infinity}   there is no hull
//   {0, infinity}          nothing is known: not finite, or a camera is not
struct Proximity {
  double min_m, max_m;
  bool operator==(const Proximity&) const = default;
};

struct ProximityOptions {
  double cap_m;        // finite, > 0
  double tolerance_m;  // > 0: most_m - least_m where the distance is below the cap
};

// Of each vertex and each triangle of a mesh, as attributes.
struct MeshProximity {
  std::vector<Proximity> vertices, triangles;
};

// Searches the cubes around each point or triangle from the nearest on (proximity_cells.h), until
// what is left lies no more than the tolerance nearer than a hull point already found. Answers
// depend on the hull, the options and the point or triangle alone, to the bit: not on the others,
// their order, what was asked before, or threads.
class HullProximity {
 public:
  // Borrows the query, which must outlive it. Keeps the cubes that it has asked about: best used
  // for all objects of a frame. Throws std::invalid_argument where the options are not as said.
  HullProximity(const hull::HullQuery& query, const ProximityOptions& options);
  ~HullProximity();

  // In the hull's pool; of the size given. One call at a time.
  void of_points(std::span<const Eigen::Vector3d> p_world_m, std::span<Proximity> proximity);
  // Of a triangle's nearest point; for degenerate triangles too. The same for all orders of its
  // vertices.
  void of_triangles(std::span<const Triangle> triangles, std::span<Proximity> proximity);

  // The vertices' as of_points() has them; triangles start from their vertices', and stand within
  // the tolerance of what of_triangles() says.
  MeshProximity of_mesh(const geometry::Mesh& mesh, const Eigen::Isometry3d& world_from_object);

  // Cubes asked about so far: what its memory goes by, 9 bytes each.
  std::size_t cubes_tested() const;

 private:
  struct Search;
  std::unique_ptr<Search> search_;
};

// A cube is split no further below this fraction of the tolerance, nor are more cubes opened for
// one point or piece of a triangle: where the hull is thinner, or its borders meet in a needle's
// point, the gap between the bounds stays wider than the tolerance.
inline constexpr double kFinestCube = 1.0 / 64;
inline constexpr int kMaxCubesOpened = 4096;

}  // namespace fivepipe::collision
