// Volume query of triangles against the visual hull in OpenGL (paper, section 4.2.4 and figure 2).
//
// Each triangle fills a viewport of its own in one window (TriangleView). The window is rendered
// once per camera, with that camera's object pixels projected onto the triangles; a fragment on an
// object pixel increments the stencil buffer. A fragment that all n cameras count has the value n
// and is in the hull. With hull::Limits::seen, a fragment that at least min_seen cameras count is
// in the hull, unless a second pass over the cameras finds it in an image on no object pixel, which
// resets its count. Triangles that do not fit into the window are queried in further windows. The
// vertices' coordinates, not glViewport, place a triangle in its viewport, so one draw call per
// camera suffices.
//
// Limit of the method, as in the paper: a detail thinner than the sample spacing (TriangleView)
// falls between samples. A triangle of 10 m can miss a hull of 1 cm, so a missing collision point
// does not prove that a triangle is free. A reported point is certain (query()).
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
  // Sorted by triangle, then row, then column of its viewport.
  std::vector<CollisionPoint> points;
  // Samples that OpenGL found in the hull in float and in_hull() rejects in double; dropped.
  std::size_t points_unconfirmed = 0;
  // Triangles that are sampled along their longest edge.
  std::size_t triangles_degenerate = 0;
};

// Needs a current OpenGL 4.5 context for construction, use and destruction. Sets the OpenGL state
// that it needs; leaves the stencil test disabled and all colours writable. Must not be shared
// between threads.
class TriangleVolumeQuery {
 public:
  // Uses viewports of viewport_px squared in a window of window_px squared. Throws
  // std::invalid_argument unless 0 < viewport_px <= window_px, or GlError.
  TriangleVolumeQuery(int window_px, int viewport_px);

  // Sets and copies the frame set that query() tests. Without silhouettes the hull is empty. Throws
  // std::invalid_argument if a map and its pinhole differ in size, or with more than 255 cameras,
  // the maximum of an 8-bit stencil.
  void set_silhouettes(std::span<const hull::Silhouette> silhouettes,
                       const hull::HullRule& rule = {});
  std::span<const hull::Silhouette> silhouettes() const { return silhouettes_; }
  const hull::HullRule& rule() const { return rule_; }

  // Every returned point is in_hull(): double confirms what OpenGL found, so rounding at a pixel's
  // border can lose a sample but cannot add one. The same input gives the same bits on the same
  // driver; drivers may differ in samples at borders. Throws std::invalid_argument if a vertex is
  // not finite.
  TriangleQueryResult query(std::span<const Triangle> triangles);

 private:
  void query_window(std::span<const Triangle> triangles, std::size_t first,
                    TriangleQueryResult& result);
  void draw(std::span<const TriangleView> views);
  // Draws the triangles once with a camera's pixels. on_object: discards the fragments that are not
  // on an object pixel; otherwise those that are, or that are outside the image.
  void draw_camera(std::size_t camera, std::size_t vertex_count, bool on_object);
  std::size_t columns() const { return std::size_t(window_px_ / viewport_px_); }

  int window_px_, viewport_px_;
  std::vector<hull::Silhouette> silhouettes_;
  hull::HullRule rule_;
  std::vector<gl::GlTexture> object_pixels_;  // by camera, 32 pixels per texel
  // No camera; with Limits::all also if a camera has no object pixel.
  bool hull_is_empty_ = true;
  gl::GlProgram program_;
  gl::GlFramebuffer window_;
  gl::GlBuffer positions_, texture_coordinates_;
  gl::GlVertexArray vertices_;
  std::vector<std::uint8_t> stencil_;
};

}  // namespace fivepipe::collision
