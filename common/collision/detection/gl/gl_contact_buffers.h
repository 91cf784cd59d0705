// Limits and buffer layouts that C++ shares with the compute shaders of backend `gl`
// (gl_detection.h): boxes.comp, triangles.comp, refine.comp, sample.comp, blocks.comp.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace fivepipe::collision::gl_contact {

inline constexpr std::uint32_t kGroup = 64;  // invocations per workgroup
// Maximum number of workgroups per dispatch; OpenGL guarantees 65535. If there are more items, each
// invocation processes several.
inline constexpr std::uint32_t kMaxGroups = 32768;
inline constexpr int kMaxTreeLevels = 8;
// Maximum number of passes over parts: an edge is halved at most 22 times (kMaxUnits), above and
// below the sample grid.
inline constexpr std::size_t kMaxPasses = 48;
// A part that is this many halvings above the sample grid is sampled as a block: 4 rows, 16
// samples.
inline constexpr int kSampledHalvings = 2;

// The following structs have the std430 layout that the shaders declare.

// Projection of points (x, y, z) [m] of a frame: (U, V, W) = at + x of_x + y of_y + z of_z. The
// image is (U, V) / W, in pixels from the base pixel; pixel p covers [p, p + 1). The fourth
// component of each column is an error bound:
//   of_x[3]  of U - u W and V - v W at the frame's origin [px m], for images (u, v) at most
//            farthest_px from the base pixel
//   at[3]    the increase of that bound per metre of distance from the origin
//   of_y[3]  of W, for every tested point [m]
//   of_z[3]  of the quotients U / W and V / W, as a fraction
struct GlCamera {
  float of_x[4], of_y[4], of_z[4], at[4];
  // min u, max u, min v, max v: of the stored pixels, and of the borders of the object pixels.
  float stored[4], bounds[4];
  // Offset of the base pixel's entry in the skip maps, and the distance between rows [bytes].
  std::int32_t first_byte, stride;
  // An image farther than this from the base pixel is beside the object pixels.
  float farthest_px;
  // A point is behind the camera if its W is below this factor times the bound of U - u W.
  float behind;
};
// With this many cameras, the uniform block is below the 16 KiB that OpenGL guarantees.
inline constexpr std::size_t kMaxCameras = 64;
struct Object {
  std::array<std::uint32_t, kMaxTreeLevels> first_box_word;  // by level
  std::uint32_t first_leaf_word, triangles, first_camera, unused;
};
// Arguments of an indirect dispatch, and its number of items.
struct Dispatch {
  std::uint32_t groups[3] = {0, 1, 1}, items = 0;
};
struct Node {
  std::uint32_t object_level, index;  // object << 8 | level
};
struct Descent {
  Dispatch nodes[kMaxTreeLevels + 1], leaves;
};
// A triangle that is not free. `place` is 16 leaf + index in the leaf, with kSolid set if the whole
// triangle is in the hull.
inline constexpr std::uint32_t kSolid = 1u << 31;
struct OpenTriangle {
  std::uint32_t object, place;
};
// Before the open triangles, in their buffer. The CPU reads no buffer that holds arguments of
// dispatches: NVIDIA's driver (580) copies such a buffer to the CPU for a dispatch, and later reads
// return that copy without what the dispatch wrote.
struct OpenHeader {
  std::uint32_t count = 0, unused = 0;
};

// A triangle to refine, with the points v0 + s (v1 - v0) + t (v2 - v0) [m] in the refinement's
// frame. Level n divides an edge into start * 2^n parts.
struct RefinedTriangle {
  float v0[3], per_start;  // per_start: 1 / start
  float v1[3];
  float radius_m;  // of a ball about the frame's origin that contains the triangle
  float v2[3];
  std::int32_t sampled;  // level of the parts that are sampled together
  std::int32_t rows;     // rows of samples in such a part
  std::int32_t finest;   // last level
  std::uint32_t unused[2];
};
// A part of level n with corners (a, b), (a + sigma, b), (a, b + sigma), in units of that level. A
// part to be sampled is called a block.
inline constexpr std::uint32_t kDown = 1u << 31;        // bit of a: sigma is -1 (inverted)
inline constexpr std::uint32_t kLevelShift = 24;        // b stores the level above this bit
inline constexpr std::uint32_t kWholePartInHull = ~0u;  // value of Part::found
struct Part {
  // found, of a block: bit i is set if sample i is in the hull, bit 16 + i if float cannot decide.
  std::uint32_t triangle, a, b, found;
};
// The pass in which a triangle's first point was found, and the pass in which the triangle was
// deferred to the CPU; kNever if that did not happen.
struct State {
  std::uint32_t found_pass, deferred_pass;
};
inline constexpr std::uint32_t kNever = ~0u;
// Value of deferred_pass if a part of the last level is still mixed.
inline constexpr std::uint32_t kUndecided = 1000;
struct Refinement {
  Dispatch parts[kMaxPasses], blocks, samples;
};
// Before the found parts, in their buffer.
struct FoundHeader {
  std::uint32_t found = 0, split = 0, overflow = 0, unused = 0;
};

}  // namespace fivepipe::collision::gl_contact
