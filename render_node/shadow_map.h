// The light's view of what casts shadows: virtual objects and the hull (paper, section 3.4).
#pragma once
#include <functional>

#include "common/config/scene.h"
#include "common/config/views.h"
#include "common/gl/objects.h"
#include "render_node/views/tile_assembler.h"

namespace fivepipe::render {

// Needs a current GL context from construction to destruction.
class ShadowMap {
 public:
  // The scene must have shadows.
  explicit ShadowMap(const config::Scene& scene);

  // Draws the objects with the program, which is in use. Sets its uniform light_clip_from_object
  // for each object.
  using DrawObjects = std::function<void(const gl::GlProgram& program,
                                         const Eigen::Matrix4d& light_clip_from_world)>;
  // Draws the map. `hull`: the hull in config::light_view(); null: the hull casts no shadow.
  // Changes the bound framebuffer, program and vertex array, and the depth and culling state.
  void draw(const DrawObjects& draw_objects, const HullFrame* hull);

  // The map: 1 / depth along the light's z [1/m]; 0: nothing.
  const gl::GlTexture& texture() const { return framebuffer_.colour(); }
  const Eigen::Isometry3d& light_from_world() const { return *view_.fixed; }
  // Focal length, in widths of the map.
  double focal() const { return focal_; }
  // A surface up to this fraction of its depth behind the map's depth is lit: kTolerance_px pixels
  // of the map. For the hull it is at least kHullTolerance_px pixels of the light's image of the
  // hull, in which the map has the hull's depth.
  double tolerance() const { return tolerance_; }
  double hull_tolerance() const { return hull_tolerance_; }

 private:
  void draw_hull(const HullFrame& hull);

  config::HullView view_;
  Eigen::Matrix4d clip_from_light_, light_clip_from_world_;
  double focal_, tolerance_, hull_tolerance_;
  gl::GlProgram object_program_, hull_program_;
  gl::GlFramebuffer framebuffer_;
  gl::GlTexture hull_depth_;
  gl::GlVertexArray no_attributes_;
};

// At a pixel that the edge of two triangles crosses, the map has the depth of the other triangle:
// on a folded cloth it differs by about a pixel.
inline constexpr double kTolerance_px = 1.5;
// The hull's normal is that of the viewer's image, and its depth in the light's image has steps of
// a pixel.
inline constexpr double kHullTolerance_px = 1.5;

}  // namespace fivepipe::render
