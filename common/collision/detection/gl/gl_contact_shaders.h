// The compute shaders of backend `gl` of the detection (gl_detection.h), as GLSL 4.5 sources, and
// the buffers that they share with its C++ side.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace fivepipe::collision::gl_contact {

inline constexpr std::uint32_t kGroup = 64;  // invocations of a workgroup
inline constexpr std::uint32_t kMaxGroups =
    32768;  // of a dispatch; each goes on to what the others leave. Every driver has twice as many
inline constexpr int kMaxTreeLevels = 8;
inline constexpr std::size_t kMaxPasses =
    48;  // over parts: an edge is halved 22 times at most (kMaxUnits), twice
inline constexpr int kSampledHalvings =
    2;  // parts of so many halvings to the samples' grid are sampled together: 4 rows, 16 samples

// std430 layouts, as the shaders declare them.
// Points (x, y, z) [m] of a frame in a camera: (U, V, W) = at + x of_x + y of_y + z of_z, the image
// (U, V) / W, in pixels from a base pixel, pixel p covering [p, p + 1). The fourth of each says
// what may be off:
//   of_x[3]   U - u W and V - v W of a point at the frame's origin [px m], for images (u, v) no
//   farther than farthest_px from the base at[3]     the same, more for each metre from there
//   of_y[3]   W [m], of all points that are asked
//   of_z[3]   the image's quotients, as a fraction
struct GlCamera {
  float of_x[4], of_y[4], of_z[4], at[4];
  float stored[4], bounds[4];  // least u, most u, least v, most v: of the pixels in store; of the
                               // object pixels' borders
  std::int32_t first_byte, stride;  // of the base pixel's reach
  float farthest_px;  // images farther than that from the base are beside the object pixels
  float behind;  // a point with W below this times what U - u W may be off is behind the camera
};
inline constexpr std::size_t kMaxCameras =
    64;  // a block of them stays within the 16 KB of uniforms that every driver has
struct Object {
  std::array<std::uint32_t, kMaxTreeLevels> first_box_word;  // by level
  std::uint32_t first_leaf_word, triangles, first_camera, unused;
};
struct Dispatch {  // indirect, and of how many items
  std::uint32_t groups[3] = {0, 1, 1}, items = 0;
};
struct Node {
  std::uint32_t object_level, index;  // object << 8 | level
};
struct Descent {
  Dispatch nodes[kMaxTreeLevels + 1], leaves;
  std::uint32_t open = 0, unused[3] = {};
};
inline constexpr std::uint32_t kSolid = 1u << 31;
struct OpenTriangle {           // not free
  std::uint32_t object, place;  // 16 leaf + lane; kSolid: all of it is in the hull
};

// A triangle to refine, in the frame of the refinement: points v0 + s (v1 - v0) + t (v2 - v0).
// Level n: an edge is divided into start 2^n.
struct RefinedTriangle {
  float v0[3], per_start;  // 1 / start
  float v1[3];
  float radius_m;  // of a ball around the origin that holds it
  float v2[3];
  std::int32_t sampled;  // the level whose parts are sampled together
  std::int32_t rows;     // of a part's samples there
  std::int32_t finest;   // the last level
  std::uint32_t unused[2];
};
// A part of level n; of one to be sampled, a block; of one where something was found. Corners (a,
// b), (a + sigma, b), (a, b + sigma), in units of that level.
inline constexpr std::uint32_t kDown = 1u << 31;  // of a: sigma is -1
inline constexpr std::uint32_t kLevelShift = 24;  // of b: above it the level
inline constexpr std::uint32_t kWholePartInHull =
    ~0u;  // of what was found: all of the part is in the hull
struct Part {
  std::uint32_t triangle, a, b,
      found;  // found, of a block: bit i: sample i is in the hull; bit 16 + i: float can't tell
};
// The pass in which the first was found of a triangle, and the one in which it was left to the CPU;
// kNever where it was not.
struct State {
  std::uint32_t found_pass, left_pass;
};
inline constexpr std::uint32_t kNever = ~0u;
inline constexpr std::uint32_t kUndecided = 1000;  // left where it can't be divided further
struct Refinement {
  Dispatch parts[kMaxPasses], blocks, samples;
  std::uint32_t found = 0, overflow = 0, unused[2] = {};
};

std::string boxes_source();      // a level of the trees: the boxes that are not free
std::string triangles_source();  // of the leaves left, the triangles that are not free
std::string refine_source();     // parts, pass by pass
std::string sample_source();     // samples of the blocks
std::string sort_source();       // blocks, by what was found in them

}  // namespace fivepipe::collision::gl_contact
