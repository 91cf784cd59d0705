// Projections of objects and triangles into the cameras' maps in float, with certified error
// bounds: the inputs of the SIMD kernels (contact_simd.h).
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>

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
  // Bounds of the object pixels, as pixel borders. Without object pixels every shape is beside
  // them.
  float begin_u, end_u, begin_v, end_v;
  // Borders of the image. Only Limits::seen uses them.
  float image_begin_u, image_end_u, image_begin_v, image_end_v;
  std::int32_t stride;
  const std::int8_t* at_base;
  // Bound of the error of an image position [px].
  float eps_px;
};

// Projection of an object's points (x, y, z) [m], relative to the origin of its tree: (U, V, W) =
// at + x of_x + y of_y + z of_z, and the image is (U, V) / W [px]. W is the depth [m].
struct ObjectMap : ContactMap {
  float at[3], of[3][3];
  // If W is below min_w, the image is too uncertain. If W is below max_behind_w, the point is
  // behind the camera.
  float min_w, max_behind_w;
  // Bound of the error of W [m].
  float slack_w;
};
// `world_from_tree` maps points relative to the tree's origin to the world; radius_m bounds their
// distance from it. Returns nullopt if the object is too large for float. Limits::all requires an
// object pixel.
std::optional<ObjectMap> object_map(const hull::CpuHull::MapCamera& camera,
                                    const Eigen::Isometry3d& world_from_tree, double radius_m,
                                    hull::Limits limits = hull::Limits::all);

// Projection of a triangle's points v0 + a / units (v1 - v0) + b / units (v2 - v0), with whole
// numbers a and b.
struct TriangleMap : ContactMap {
  float at[3], by_a[3], by_b[3];
};
// culled: the camera certainly sees no point of the triangle on the object, because the triangle is
// behind the camera or its image is beside the object pixels. With Limits::seen: the camera
// certainly sees no point of the triangle, because it is behind or its image is beside the
// camera's. uncertain: the triangle is too close to the camera's plane, or too large, for float.
enum class ProjectionStatus { in_front, culled, uncertain };
// Maps a world point [m] to (U, V, W); pixel p covers [p, p + 1) of U / W [px].
using PixelFromWorld = Eigen::Matrix<double, 3, 4>;
PixelFromWorld pixel_from_world(const geometry::Camera& camera);
// Sets `map` only if it returns in_front. `seen_image`: the camera's image with Limits::seen, null
// with Limits::all, which requires an object pixel.
ProjectionStatus triangle_map(const PixelFromWorld& pixel, const hull::SkipMap& skip_map,
                              const std::array<Eigen::Vector3d, 3>& vertices_world_m, double units,
                              TriangleMap& map, const hull::PixelRect* seen_image = nullptr);

}  // namespace fivepipe::collision
