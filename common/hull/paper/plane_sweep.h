// Backend `sweep`: the paper's volume querying (section 3.2). Planes orthogonal to the view
// direction sweep the view frustum from front to back. Each camera's object pixels are projected
// onto the plane as a texture. The stencil buffer counts the cameras whose object pixels cover a
// pixel of the plane. A pixel that all n cameras cover keeps the plane's depth, by the depth test.
// With Limits::seen, at least min_seen cameras must cover it; a pixel that a camera sees in its
// image on no object pixel loses its count.
//
// This is an approximation: the sweep finds a ray's first hull point at the first plane behind it,
// up to one plane spacing too far. It can miss parts of the hull that are thinner than the spacing.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/gl/objects.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

// Range of the planes: depths along the view's z axis [m], 0 < near_m < far_m.
struct SweepRange {
  double near_m, far_m;
  bool empty() const { return !(near_m < far_m); }
};

// Returns the part of the view's depth range that a world box [m] covers; empty if there is none.
SweepRange sweep_range(const View& view, const Eigen::AlignedBox3d& volume_world_m);

// The stencil buffer has 8 bits.
inline constexpr std::size_t kMaxSweepCameras = 255;

// Requires a current OpenGL 4.5 context from construction to destruction. Expects the initial
// OpenGL state, except bindings. depth() changes bindings, viewport, scissor box, and stencil
// function and operation. It leaves the scissor, depth and stencil tests disabled.
class PlaneSweep {
 public:
  // Creates a sweep for views of this size; planes > 0. Throws GlError.
  PlaneSweep(int width_px, int height_px, int planes);
  int width_px() const { return frame_.colour().width_px(); }
  int height_px() const { return frame_.colour().height_px(); }
  int planes() const { return planes_; }

  // Uploads the object pixels. Throws std::invalid_argument for more than kMaxSweepCameras
  // silhouettes. The hull is empty if a camera is not finite; with Limits::all also if a camera has
  // no object pixel.
  void set_silhouettes(std::span<const Silhouette> silhouettes, const HullRule& rule = {});

  // Sweeps once for all rects, which must be inside the view's image and not overlap. The view must
  // have this sweep's size. Plane k of `planes` is at near_m + k * (far_m - near_m) / planes. The
  // depths of a rect do not depend on the other rects.
  std::vector<DepthTile> depth(const View& view, const SweepRange& range,
                               std::span<const PixelRect> rects) const;

 private:
  struct MapTexture {
    geometry::Camera camera;
    PixelRect bounds;  // of its object pixels
    gl::GlTexture texture;
  };
  void sweep(const View& view, const SweepRange& range, const PixelRect& pixels) const;
  // Counts the cameras that cover each pixel of a plane in the stencil buffer.
  void count_cameras(float depth_m,
                     std::span<const Eigen::Matrix<float, 3, 4>> textures_from_view) const;
  void scissor(const PixelRect& pixels) const;
  void clear(std::span<const PixelRect> rects, const PixelRect& around) const;
  DepthTile read_back(const PixelRect& rect) const;

  int planes_;
  gl::GlFramebuffer frame_;  // colour: depth [m]
  gl::GlVertexArray no_attributes_;
  gl::GlProgram count_, keep_;
  std::vector<MapTexture> maps_;
  HullRule rule_;
  bool hull_is_empty_ = true;
};

}  // namespace fivepipe::hull
