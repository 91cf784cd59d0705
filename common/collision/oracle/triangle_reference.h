// Exact reference for triangles: maps each camera's object pixels onto the triangle by the
// homography of its plane, and intersects the polygons of all cameras. Computes in double, favours
// clarity over speed, and shares no code with the backends that the tests compare with it. With a
// silhouette that is not finite the hull is empty.
#pragma once
#include <span>
#include <vector>

#include "common/collision/detection/triangle.h"
#include "common/collision/oracle/distance_reference.h"

namespace fivepipe::collision {

// Points of the triangle with a smaller depth in front of a camera [m] are excluded, because the
// camera's center has no image.
inline constexpr double kReferenceNearest_m = 1e-9;

// A convex polygon on a triangle, in barycentric weights of the vertices of sorted(); the weights
// of a point sum to 1.
using WeightPolygon = std::vector<Eigen::Vector3d>;

// Returns the vertices in lexicographic order, which makes all results independent of the given
// order, to the bit.
Triangle sorted(const Triangle& triangle);

// Returns polygons with disjoint interiors whose union is the intersection of hull and triangle.
// The union is exact to 1e-15 of the triangle's longest edge and to the rounding of in_hull(). A
// contact without area may be missing, or may appear with an area of rounding size. A triangle
// without area (collinear, or a point) is a normal case: its polygons have an area in weights.
// Throws std::invalid_argument if a vertex is not finite.
std::vector<WeightPolygon> weights_in_hull(std::span<const hull::Silhouette> silhouettes,
                                           const Triangle& triangle,
                                           const hull::HullRule& rule = {});

// Returns the polygons of weights_in_hull() as world points [m].
std::vector<std::vector<Eigen::Vector3d>> hull_on_triangle(
    std::span<const hull::Silhouette> silhouettes, const Triangle& triangle,
    const hull::HullRule& rule = {});

struct TriangleTruth {
  bool crosses = false;         // a part of the triangle is in the hull
  bool inside = false;          // the whole triangle is in the hull, up to kRoundingOfArea
  double fraction_in_hull = 0;  // of the area in weights; defined for a triangle without area too
  double area_m2 = 0, area_in_hull_m2 = 0;
  // The deepest tested point and its depth, and an upper bound of the maximum depth. The bound
  // exceeds the depth by at most kDepthTolerance_m and kDepthToleranceFraction, except after
  // kMaxDepthCells. Without a tested point in the hull the depth is 0 and the point is a vertex.
  Eigen::Vector3d deepest_world_m = Eigen::Vector3d::Zero();
  double deepest_m = 0, deepest_at_most_m = 0;
};
// Uses Limits::all. Throws std::invalid_argument if a vertex is not finite.
TriangleTruth triangle_truth(const HullDistance& hull, const Triangle& triangle);

// Bound of the rounding error of an area fraction: the sum of several thousand pieces, each exact
// to about 1e-15.
inline constexpr double kRoundingOfArea = 1e-10;
// The search for the deepest point ends within 10 um and 1 %, a tenth of the smallest eps_m in use.
inline constexpr double kDepthTolerance_m = 1e-5, kDepthToleranceFraction = 0.01;
// Maximum number of cells of the search for the deepest point. A triangle along the hull's surface
// reaches it after about a second, because a whole area of its points is deepest.
inline constexpr int kMaxDepthCells = 100'000;

}  // namespace fivepipe::collision
