// Certified verdict and collision points of one triangle against the visual hull (cpu_detection.h,
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
  // Maximum number of samples per triangle; a grid with more is coarsened.
  std::size_t max_points;
};

// Coordinates along an edge, in units of the grid, are whole numbers up to this value, so float
// represents them exactly.
inline constexpr double kMaxUnits = 1 << 22;

// The division of a triangle's edges: samples are at most spacing_m apart, and the smallest parts
// at most eps_m / 16 large.
struct TriangleGrid {
  // Number of parts of the first division: 1 or 3.
  int start = 1;
  // Divisions of the sample grid: start times a power of two.
  int divisions = 1;
  // Divisions of the finest grid: `divisions` times a power of two. A value above kMaxUnits means
  // that float cannot represent a grid that is fine enough.
  double units = 1;
  // The samples are farther apart than spacing_m.
  bool coarser = false;
};
TriangleGrid triangle_grid(const Triangle& triangle_world_m, const TriangleWalkOptions& options,
                           double spacing_m);
// Returns the indices of the vertices in lexicographic order of their coordinates. The resulting
// sequence of vertices does not depend on the given order.
std::array<std::size_t, 3> vertex_order(const Triangle& triangle_world_m);

struct PointRequest {
  // 0: the verdict alone and one point.
  double spacing_m;
  Eigen::Vector3d farthest_from_world_m;
};

struct TriangleContact {
  CollisionVerdict verdict = CollisionVerdict::free;
  // The samples are farther apart than requested.
  bool coarser = false;
  std::size_t points_in_double = 0;
  // The triangle had too many parts to test. If it is undecided, nothing bounds the thickness of
  // its parts in the hull.
  bool cut_off = false;
};

// Reuses its buffers, so it must not be shared between threads. Borrows the query, which must
// outlive it.
class TriangleWalk {
 public:
  TriangleWalk(const hull::HullQuery& query, const TriangleWalkOptions& options);

  // Adds the triangle's points in the hull to `points` as the next triangle. The last one is the
  // point farthest from the reference point; it is repeated if it is also a previous sample. The
  // vertices must be finite; the result does not depend on their order. `solid`: the whole triangle
  // is known to be in the hull.
  TriangleContact walk(const Triangle& triangle_world_m, bool solid, const PointRequest& request,
                       ContactPoints& points);

 private:
  enum class Maps { free, all, some };
  struct Camera {
    PixelFromWorld pixel_from_world;
    hull::PixelRect image;
  };
  CollisionVerdict walk_in_box(const Triangle& vertices);
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
  Eigen::Vector3d in_box(const Eigen::Vector3d& p_world_m) const;
  void add(const Eigen::Vector3d& p_world_m);
  void consider(const Eigen::Vector3d& p_world_m);

  const hull::HullQuery* query_;
  TriangleWalkOptions options_;
  std::vector<Camera> cameras_;  // of the hull
  ContactRule rule_;
  Eigen::AlignedBox3d inner_box_world_m_;  // rounding leaves the rule's box from outside it only
  bool is_clipped_ = false;                // by the rule's box
  TriangleContact contact_;
  // The current part: its vertices, and its edges divided by units_.
  Triangle vertices_;
  Eigen::Vector3d per_a_m_, per_b_m_;
  std::vector<TriangleMap> maps_;
  // As in TriangleGrid.
  int divisions_ = 1, start_ = 1;
  double units_ = 1;
  Cells cells_, mixed_, solid_, inside_, uncertain_;
  ContactPoints* points_ = nullptr;
  PointRequest request_{};
  bool coarser_ = false;  // of the current part's grid
  int parts_ = 0;         // number of parts of the triangle after the cuts so far
  Eigen::Vector3d farthest_world_m_;
  double farthest_m2_ = -1;
};

}  // namespace fivepipe::collision
