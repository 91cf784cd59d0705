// The exact reference for triangles: each camera's object pixels mapped by the plane's homography
// onto the triangle, the polygons of all cameras intersected (design, "Exact reference"). Written
// for clarity, in double, slow; shares no code with the backends that are held against it. By the
// rule Limits::all. Silhouettes are finite, or there is no hull.
#pragma once
#include <span>
#include <vector>

#include "common/collision/detection/triangle.h"
#include "common/collision/oracle/distance_reference.h"

namespace fivepipe::collision {

// The triangle's points less than this in front of a camera [m] are left out: at its centre there
// is no pixel to ask for.
inline constexpr double kReferenceNearest_m = 1e-9;

// A convex polygon on a triangle by barycentric weights of its vertices, which sum up to 1; of the
// triangle's vertices as sorted().
using WeightPolygon = std::vector<Eigen::Vector3d>;

// The vertices in lexicographic order: nothing below depends on the order given, to the bit.
Triangle sorted(const Triangle& triangle);

// Polygons of disjoint interiors whose union is what the hull holds of the triangle. To rounding:
// of lengths of 1e-15 of the triangle's longest edge, and what in_hull()'s own rounding comes to.
// What merely touches the hull, without area on the triangle, may be missing, or be there with an
// area of rounding. A triangle without area (collinear, a point) is as any other: weights have an
// area where the world's polygon is a segment or a point. Throws std::invalid_argument for a vertex
// that is not finite.
std::vector<WeightPolygon> weights_in_hull(std::span<const hull::Silhouette> silhouettes,
                                           const Triangle& triangle);

// The same in the world [m].
std::vector<std::vector<Eigen::Vector3d>> hull_on_triangle(
    std::span<const hull::Silhouette> silhouettes, const Triangle& triangle);

struct TriangleTruth {
  bool crosses = false;         // some of it is in the hull
  bool inside = false;          // all of it is, but for kRoundingOfArea
  double fraction_in_hull = 0;  // of its weights' area: defined where its area is 0 too
  double area_m2 = 0, area_in_hull_m2 = 0;
  // The deepest of its points that were asked, and how deep the deepest of all may be: at most
  // kDepthTolerance more, unless after kMaxDepthCells it is less certain. Depth 0, and a vertex,
  // where none of them is in the hull.
  Eigen::Vector3d deepest_world_m = Eigen::Vector3d::Zero();
  double deepest_m = 0, deepest_at_most_m = 0;
};
TriangleTruth triangle_truth(const HullDistance& hull, const Triangle& triangle);

// Sums of areas of some thousand pieces, each right to 1e-15 or so; what is smaller than this, of
// the triangle's, is not told from nothing.
inline constexpr double kRoundingOfArea = 1e-10;
// The search for the deepest point ends within 10 um and 1 %: finer than the finest eps in use by
// ten.
inline constexpr double kDepthTolerance_m = 1e-5, kDepthToleranceFraction = 0.01;
// A triangle that lies along the hull's surface has a whole plain of deepest points, each as good
// as any: a second or so.
inline constexpr int kMaxDepthCells = 100'000;

}  // namespace fivepipe::collision
