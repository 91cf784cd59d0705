// Backend `sweep`: the paper's volume querying (section 3.2). Planes orthogonal to the view
// direction sweep the view frustum front to back; each camera's object pixels are projected onto
// the plane as a texture, the stencil counts the cameras whose object pixels hit a pixel of the
// plane, and pixels counted by all n keep the plane's depth, z-buffered.
//
// An approximation: a ray's first hull point is found at the first plane behind it, up to one plane
// spacing too far, and what is thinner than the spacing passes between planes.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/gl/objects.h"
#include "common/hull/hull.h"

namespace fivepipe::hull {

// Where planes are spent: depth along the view's z [m], 0 < near < far.
struct SweepRange {
  double near_m, far_m;
  bool empty() const { return !(near_m < far_m); }
};

// The part of the view's own range in which a world box lies; empty where it lies in none of it.
SweepRange sweep_range(const View& view, const Eigen::AlignedBox3d& volume_world_m);

// Stencil counts fit 8 bits.
inline constexpr std::size_t kMaxSweepCameras = 255;

// Needs a current OpenGL 4.5 context from construction to destruction; leaves its state as a new
// context has it, but for bindings.
class PlaneSweep {
 public:
  // For views of this size, planes > 0. Throws GlError.
  PlaneSweep(int width_px, int height_px, int planes);
  int width_px() const { return frame_.colour().width_px(); }
  int height_px() const { return frame_.colour().height_px(); }
  int planes() const { return planes_; }

  // Uploads the object pixels; at most kMaxSweepCameras, else std::invalid_argument. Cameras that
  // are not finite or have no object pixel empty the hull.
  void set_silhouettes(std::span<const Silhouette> silhouettes);

  // One sweep for all rects, which lie inside the view's image and don't overlap; the view has this
  // sweep's size. Plane k of `planes` is at near + k * (far - near) / planes. A rect's depths don't
  // depend on the others.
  std::vector<DepthTile> depth(const View& view, const SweepRange& range,
                               std::span<const PixelRect> rects) const;
  DepthTile depth(const View& view, const SweepRange& range, const PixelRect& rect) const;

 private:
  struct MapTexture {
    geometry::Camera camera;
    PixelRect bounds;  // of its object pixels
    gl::GlTexture texture;
  };
  void sweep(const View& view, const SweepRange& range, const PixelRect& pixels) const;
  void scissor(const PixelRect& pixels) const;
  void clear(std::span<const PixelRect> rects, const PixelRect& around) const;
  DepthTile read_back(const PixelRect& rect) const;

  int planes_;
  gl::GlFramebuffer frame_;  // colour: depth [m]
  gl::GlVertexArray no_attributes_;
  gl::GlProgram count_, keep_;
  std::vector<MapTexture> maps_;
  bool hull_is_empty_ = true;
};

}  // namespace fivepipe::hull
