// SIMD tests of boxes, triangles and parts of a triangle against the object pixels of all cameras,
// in float with certified margins.
//
// A convex shape projects into the rectangle around the images of its corners. It is free if one
// camera has no object pixel in that rectangle, solid (wholly in the hull) if every camera has only
// object pixels in its rectangle, and mixed otherwise. One or two lookups in the SkipMap decide a
// rectangle: the uniform box ahead of its upper left pixel, and that of a pixel farther along,
// cover it or do not (Quadrant::right_down). Requires the hull rule Limits::all.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "common/collision/detection/bvh.h"
#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::collision {

// Image positions with a larger error bound are not used [px].
inline constexpr double kMaxContactEps_px = 1.0 / 64;
// Relative rounding error of a point's projection in double, here and in in_hull() together: fewer
// than 30 roundings of half an epsilon each.
inline constexpr double kProjectionError = 32 * std::numeric_limits<double>::epsilon();

// A camera's map as the SIMD kernels read it. Pixel p covers [p, p + 1). Pixels count from a base
// pixel near the tested shapes, which keeps float coordinates small.
struct ContactMap {
  // First and last stored column and row.
  float min_u, max_u, min_v, max_v;
  // Bounds of the object pixels, as pixel borders.
  float begin_u, end_u, begin_v, end_v;
  std::int32_t stride;
  const std::int8_t* at_base;
  // Bound of the error of an image position [px].
  float eps_px;
};

// Projection of an object's points (x, y, z) [m], relative to the origin of its tree:
// (U, V, W) = at + x of_x + y of_y + z of_z, and the image is (U, V) / W.
struct ObjectMap : ContactMap {
  float at[3], of[3][3];
  // If W is below min_w, the image is too uncertain. If W is below max_behind_w, the point is
  // behind the camera.
  float min_w, max_behind_w;
  // Bound of the error of W.
  float slack_w;
};
// `world_from_tree` maps points relative to the tree's origin to the world; radius_m bounds their
// distance from it. Returns nullopt if the object is too large for float.
std::optional<ObjectMap> object_map(const hull::CpuHull::MapCamera& camera,
                                    const Eigen::Isometry3d& world_from_tree, double radius_m);

// Bit i refers to box or triangle i; a shape with neither bit is mixed.
struct ContactBits {
  std::uint32_t free, solid;
};
ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes);
ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf, int triangles);

// Projection of a triangle's points v0 + a / units (v1 - v0) + b / units (v2 - v0), where a and b
// are whole numbers.
struct TriangleMap : ContactMap {
  float at[3], by_a[3], by_b[3];
};
// culled: certainly free, because the triangle is behind the camera or its image is beside the
// object pixels. uncertain: the triangle is too close to the camera's plane, or too large, for
// float.
enum class ProjectionStatus { in_front, culled, uncertain };
// Projects a world point to (U, V, W); pixel p covers [p, p + 1) of U / W.
using PixelFromWorld = Eigen::Matrix<double, 3, 4>;
PixelFromWorld pixel_from_world(const geometry::Camera& camera);
// Sets `map` if the result is in_front.
ProjectionStatus triangle_map(const PixelFromWorld& pixel, const hull::SkipMap& skip_map,
                              const std::array<Eigen::Vector3d, 3>& vertices_world_m, double units,
                              TriangleMap& map);

// Congruent parts of a triangle with corners (a, b), (a + sigma h, b), (a, b + sigma h); sigma is 1
// (upright) or -1 (inverted).
struct Cells {
  std::vector<float> a, b, sigma;
  std::size_t count = 0;
  void clear() { count = 0; }
  // Reserves `more` cells and one SIMD vector, which the kernels may write beyond the last cell.
  void make_room(std::size_t more) {
    if (a.size() < count + more + 16)
      a.resize(2 * (count + more) + 64), b.resize(a.size()), sigma.resize(a.size());
  }
  void add(float at_a, float at_b, float of_sigma) {
    make_room(1);
    a[count] = at_a, b[count] = at_b, sigma[count++] = of_sigma;
  }
};
// Appends the mixed cells to `mixed` and the solid ones to `solid`; drops the free ones.
void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid);
// Appends the cells whose center is in the hull to `inside`, and those whose center float cannot
// decide to `uncertain`.
void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain);

}  // namespace fivepipe::collision
