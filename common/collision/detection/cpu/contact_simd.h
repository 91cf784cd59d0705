// SIMD tests of boxes, triangles and parts of a triangle against the object pixels of all cameras,
// in float with certified margins.
//
// A convex shape projects into the rectangle around the images of its corners. One or two lookups
// in the SkipMap decide a rectangle: the uniform box ahead of its upper left pixel covers it, or
// that box and the one ahead of a pixel farther along do (Quadrant::right_down), or the rectangle
// counts as mixed. By the hull rule, a shape is free, solid (wholly in the hull), or mixed:
//
//   all:  free if one camera has no object pixel in its rectangle, or is behind the shape. Solid if
//         every camera has only object pixels in its rectangle.
//   seen: free if one camera sees all of the shape and has no object pixel in its rectangle, or if
//         fewer than min_seen cameras can have an object pixel there. Solid if every camera has
//         only object pixels in its rectangle or sees no point of the shape, and at least min_seen
//         have object pixels.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/collision/detection/bvh.h"
#include "common/collision/detection/cpu/contact_maps.h"

namespace fivepipe::collision {

// Bit i refers to box or triangle i; a shape with neither bit is mixed.
struct ContactBits {
  std::uint32_t free, solid;
};
// The hull rule, as the kernels apply it. With Limits::seen nothing is solid if `unmapped` is not
// 0; with Limits::all the caller must then ignore ContactBits::solid.
struct ContactRule {
  hull::HullRule hull;
  int unmapped = 0;  // cameras that may see any part of the object, but are not among the maps
};
ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes,
                           const ContactRule& rule = {});
// triangles: number of triangles in the leaf.
ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf, int triangles,
                          const ContactRule& rule = {});

// Congruent parts of a triangle with corners (a, b), (a + sigma h, b), (a, b + sigma h), in units
// of the triangle's grid (TriangleMap); sigma is 1 (upright) or -1 (inverted).
struct Cells {
  std::vector<float> a, b, sigma;
  std::size_t count = 0;
  void clear() { count = 0; }
  // Reserves `more` cells and one SIMD vector, which the kernels may write beyond the last cell.
  void reserve_more(std::size_t more) {
    if (a.size() < count + more + 16)
      a.resize(2 * (count + more) + 64), b.resize(a.size()), sigma.resize(a.size());
  }
  void add(float at_a, float at_b, float of_sigma) {
    reserve_more(1);
    a[count] = at_a, b[count] = at_b, sigma[count++] = of_sigma;
  }
};
// Appends the mixed cells of size h to `mixed` and the solid ones to `solid`; drops the free ones.
// Cameras that see no point of the triangle need no map with Limits::seen.
void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid, const ContactRule& rule = {});
// Appends the cells whose center is in the hull to `inside`, and those whose center float cannot
// decide to `uncertain`. Requires rule.unmapped == 0.
void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain, const ContactRule& rule = {});

}  // namespace fivepipe::collision
