// One triangle against the visual hull: certified verdict and collision points (cpu_detection.h,
// steps 3 and 4).
#pragma once
#include <vector>

#include "common/collision/detection/contact_points.h"
#include "common/collision/detection/cpu/contact_simd.h"
#include "common/collision/detection/triangle.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

struct TriangleWalkOptions {
  double eps_m;
  std::size_t max_points;  // of a triangle; where the spacing would give more samples than that,
                           // they are farther apart
};

// Whole numbers up to here are float [units of an edge].
inline constexpr double kMaxUnits = 1 << 22;

// How finely a triangle's edges are divided: samples no farther apart than the spacing, the finest
// parts no larger than eps over sixteen.
struct TriangleGrid {
  int start = 1;      // into so many an edge is divided first: 1 or 3
  int divisions = 1;  // by the samples' grid: start times a power of two
  double units = 1;   // the finest: divisions times a power of two; more than kMaxUnits where that
                      // would not be fine enough
  bool coarser = false;  // samples are farther apart than asked for
};
TriangleGrid triangle_grid(const Triangle& triangle_world_m, const TriangleWalkOptions& options,
                           double spacing_m);
// Which vertex comes first, second, third in an order that does not depend on the order given.
std::array<std::size_t, 3> vertex_order(const Triangle& triangle_world_m);

struct PointRequest {
  double spacing_m;  // 0: the verdict alone, and one point
  Eigen::Vector3d farthest_from_world_m;
};

struct TriangleContact {
  CollisionVerdict verdict = CollisionVerdict::free;
  bool coarser = false;  // samples are farther apart than asked for
  std::size_t points_in_double = 0;
  bool cut_off = false;  // there were too many parts to look at: if touching, of nothing is known
                         // how thin it is
};

class TriangleWalk {  // of one thread; keeps its buffers. The query must outlive it.
 public:
  TriangleWalk(const hull::HullQuery& query, const TriangleWalkOptions& options);

  // Adds the triangle's points in the hull, as one more triangle; the one farthest from the
  // reference is the last, once more where it is a sample before. The same for every order of the
  // vertices, which are finite. solid: known to lie in the hull, all of it.
  TriangleContact walk(const Triangle& triangle_world_m, bool solid, const PointRequest& wanted,
                       ContactPoints& points);

 private:
  enum class Maps { free, all, some };
  CollisionVerdict walk_part(const Triangle& vertices, int depth);
  CollisionVerdict accept_all(const Triangle& vertices);
  CollisionVerdict split_part(const Triangle& vertices, int depth);
  CollisionVerdict test_corners(const Triangle& vertices);
  Maps set_maps();
  void choose_grid();
  void begin_cells(int divisions);
  void split_cells(const Cells& cells, double h);
  bool sample();
  bool coarse_test();
  CollisionVerdict decide();
  CollisionVerdict resolve_exact(double h);
  void accept_inside(double h);
  void accept_solid(double h, double sample_h);
  Eigen::Vector3d point(double a, double b) const;
  Eigen::Vector3d center(const Cells& cells, std::size_t i, double h) const;
  void add(const Eigen::Vector3d& p_world_m);
  void consider(const Eigen::Vector3d& p_world_m);

  const hull::HullQuery* query_;
  TriangleWalkOptions options_;
  std::vector<PixelFromWorld> pixels_from_world_;  // as the hull's cameras
  TriangleContact contact_;
  Triangle vertices_;                  // of the part at hand
  Eigen::Vector3d per_a_m_, per_b_m_;  // along its edges, a unit
  std::vector<TriangleMap> maps_;
  int divisions_ = 1, start_ = 1;  // as TriangleGrid
  double units_ = 1;
  Cells cells_, mixed_, solid_, inside_, uncertain_;
  ContactPoints* points_ = nullptr;
  PointRequest wanted_{};
  bool coarser_ = false;  // the grid of the part at hand
  int parts_ = 0;         // of the triangle, cut so far
  Eigen::Vector3d farthest_world_m_;
  double farthest_m2_ = -1;
};

}  // namespace fivepipe::collision
