// The surface of virtual objects volume-queried against the visual hull in OpenGL (paper,
// section 4.2.4 and figure 2).
//
// Each triangle has its own viewport in one window and fills it (see TriangleView). The window is
// rendered once for each camera with that camera's object pixels projected onto the triangles; a
// fragment on an object pixel counts one up in the stencil buffer. What the last of n cameras has
// counted to n is in the hull. Triangles that find no room wait for the next filling of the window.
// A triangle is put into its viewport by its vertices' coordinates, not by glViewport: one draw a
// camera, three times faster on llvmpipe.
//
// Limit of the method, as in the paper: what is thinner than the samples' spacing (TriangleView)
// passes between them. A hull of 1 cm can be missed by a triangle of 10 m; a missing collision
// point proves nothing. A reported one is certain: see query().
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/collision/detection/detection.h"
#include "common/collision/detection/triangle.h"
#include "common/gl/objects.h"
#include "common/hull/hull.h"

namespace fivepipe::collision {

struct TriangleQueryResult {
  std::vector<CollisionPoint> points;  // by triangle, then row, then column of its viewport
  std::size_t points_unconfirmed =
      0;  // counted to n by OpenGL in floats, but not in_hull() in double: dropped
  std::size_t triangles_degenerate = 0;  // sampled along their longest edge
  std::size_t windows = 0;               // fillings of the window: draws are windows * cameras
};

// Needs a current OpenGL 4.5 context for construction, use and destruction; expects and leaves
// nothing of OpenGL's state but the stencil test off and all colours written. Not to be shared
// between threads.
class TriangleVolumeQuery {
 public:
  // Viewports of viewport_px squared in a window of window_px squared. Throws std::invalid_argument
  // unless 0 < viewport_px <= window_px.
  TriangleVolumeQuery(int window_px, int viewport_px);

  // The frame set that is queried from now on; copied. Throws std::invalid_argument where a map has
  // not its pinhole's size, or with more cameras than eight bits of stencil count (255). None: the
  // hull is empty.
  void set_silhouettes(std::span<const hull::Silhouette> silhouettes);
  std::span<const hull::Silhouette> silhouettes() const { return silhouettes_; }

  // Every point is in_hull(): what OpenGL found is confirmed in double, so rounding at a pixel's
  // border can lose a sample but not invent one. The same input gives the same bits on the same
  // OpenGL driver; drivers may differ by samples at borders. Throws std::invalid_argument where a
  // vertex is not finite.
  TriangleQueryResult query(std::span<const Triangle> triangles);

 private:
  void query_window(std::span<const Triangle> triangles, std::size_t first,
                    TriangleQueryResult& result);
  void draw(std::span<const TriangleView> views);
  std::size_t columns() const { return std::size_t(window_px_ / viewport_px_); }

  int window_px_, viewport_px_;
  std::vector<hull::Silhouette> silhouettes_;
  std::vector<gl::GlTexture> object_pixels_;  // by camera, 32 pixels a texel
  bool hull_is_empty_ = true;                 // no camera, or one without object pixels
  gl::GlProgram program_;
  gl::GlFramebuffer window_;
  gl::GlBuffer positions_, texture_coordinates_;
  gl::GlVertexArray vertices_;
  std::vector<std::uint8_t> stencil_;
};

}  // namespace fivepipe::collision
