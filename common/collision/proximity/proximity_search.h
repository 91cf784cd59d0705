// The search of HullProximity for one point or triangle.
#pragma once
#include <optional>
#include <vector>

#include "common/collision/proximity/lazy_octree.h"
#include "common/collision/proximity/proximity.h"
#include "common/collision/proximity/proximity_shapes.h"

namespace fivepipe::collision {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr Proximity kInHull{0, 0}, kEmptyHull{kInfinity, kInfinity}, kUnknown{0, kInfinity};

// Edge of the lattice cubes in caps.
inline constexpr double kRootEdge_caps = 4;

// A cube that may hold nearer hull points than those found.
struct Candidate {
  double to_m2;  // lower bound of the squared distance
  LazyOctree::Cube cube;
  double half_edge_m;
  // Sorts the nearest candidate last, where it is popped next.
  bool operator<(const Candidate& other) const { return to_m2 > other.to_m2; }
};
struct Candidates {
  std::vector<Candidate> now, later;
};

struct HullProximity::Search {
  const hull::HullQuery& query;
  ProximityOptions options;
  LazyOctree cells;
  std::vector<Candidates> candidates;  // one per thread

  Search(const hull::HullQuery& q, const ProximityOptions& o)
      : query(q),
        options(o),
        cells(q, kRootEdge_caps * o.cap_m, q.hull().pool().threads()),
        candidates(std::size_t(q.hull().pool().threads())) {}

  std::optional<Proximity> trivial_proximity(const Eigen::Vector3d& p_world_m) const;
  Proximity of_point(const Eigen::Vector3d& p_world_m, int thread);
  // known: bounds of the distance; a larger upper bound is not searched for.
  Proximity of_triangle(Triangle triangle, const Proximity& known, int thread);
  Proximity of_piece(const TriangleShape& piece, double max_m, int thread);
  template <class Shape>
  class Nearest;
};

}  // namespace fivepipe::collision
