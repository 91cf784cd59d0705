// Boxes, triangles, and parts of a triangle against the object pixels of all cameras, in vector
// lanes, in float with certified margins.
//
// What is convex projects into the rectangle around the images of its corners. One camera without
// an object pixel in that rectangle: free. All cameras with object pixels alone in theirs: solid,
// all of it is in the hull. Else mixed. The rectangle is looked up in one step or two: the boxes
// ahead of its upper left pixel, and of one farther along, cover it or don't (SkipMap,
// Box::right_down). Rule: Limits::all.
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

// Positions of images less certain than this are not used [px].
inline constexpr double kMaxContactEps_px = 1.0 / 64;
// Roundings of double on a point's way to its pixel, there and in in_hull() together: fewer than
// 30, of half an epsilon each.
inline constexpr double kProjectionError = 32 * std::numeric_limits<double>::epsilon();

// What lanes read of a camera's map; pixel p covers [p, p + 1), counted from a base pixel near what
// is looked at.
struct ContactMap {
  float min_u, max_u, min_v, max_v;      // stored pixels, the outermost
  float begin_u, end_u, begin_v, end_v;  // borders of the bounds of the object pixels
  std::int32_t stride;
  const std::int8_t* at_base;
  float eps_px;  // positions may be off by this
};

// An object's points (x, y, z) [m] about its tree's origin: (U, V, W) = at + x of_x + y of_y + z
// of_z; the image is (U, V) / W.
struct ObjectMap : ContactMap {
  float at[3], of[3][3];
  float min_w, max_behind_w;  // nearer than the one the image is too uncertain; below the other
                              // the point is behind the camera
  float slack_w;              // W may be off by this
};
// None where the object's extent is too large for float: `world_from_tree` takes points about the
// tree's origin into the world.
std::optional<ObjectMap> object_map(const hull::CpuHull::MapCamera& camera,
                                    const Eigen::Isometry3d& world_from_tree, double radius_m);

struct ContactBits {
  std::uint32_t free, solid;  // bit i: of box or triangle i
};
ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes);
ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf, int triangles);

// A triangle's points v0 + a / units (v1 - v0) + b / units (v2 - v0), for whole numbers a, b.
struct TriangleMap : ContactMap {
  float at[3], by_a[3], by_b[3];
};
// culled: behind the camera, or beside the object pixels; certainly free. uncertain: it comes too
// near to the camera's plane, or is too large, for float.
enum class ProjectionStatus { in_front, culled, uncertain };
// (U, V, W) of a point of the world; pixel p covers [p, p + 1) of U / W.
using PixelFromWorld = Eigen::Matrix<double, 3, 4>;
PixelFromWorld pixel_from_world(const geometry::Camera& camera);
ProjectionStatus triangle_map(const PixelFromWorld& pixel, const hull::SkipMap& skip_map,
                              const std::array<Eigen::Vector3d, 3>& vertices_world_m, double units,
                              TriangleMap& map);

// Parts of a triangle, alike in size: corners (a, b), (a + sigma h, b), (a, b + sigma h), sigma = 1
// or -1.
struct Cells {
  std::vector<float> a, b, sigma;
  std::size_t count = 0;
  void clear() { count = 0; }
  void make_room(std::size_t more) {  // and a vector's more
    if (a.size() < count + more + 16)
      a.resize(2 * (count + more) + 64), b.resize(a.size()), sigma.resize(a.size());
  }
  void add(float at_a, float at_b, float of_sigma) {
    make_room(1);
    a[count] = at_a, b[count] = at_b, sigma[count++] = of_sigma;
  }
};
// Appends those that are mixed, and those that are solid; free ones are left out.
void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid);
// The cells' middles: appends the cells whose middle is in the hull, and those where float can't
// tell.
void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain);

}  // namespace fivepipe::collision
