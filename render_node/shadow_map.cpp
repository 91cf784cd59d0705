#include "render_node/shadow_map.h"

#include <algorithm>

#include "common/geometry/gl_camera.h"
#include "common/gl/shader_source.h"
#include "render_node/shaders/shaders_embedded.h"

namespace fivepipe::render {
namespace {

constexpr int kHullUnit = 0;

}  // namespace

ShadowMap::ShadowMap(const config::Scene& scene)
    : view_(*config::light_view(scene)),
      object_program_("shadows of objects", shaders::kShadowObjectVert, shaders::kShadowObjectFrag),
      hull_program_("shadow of the hull", shaders::kShadowHullVert, shaders::kShadowHullFrag),
      framebuffer_(scene.shadows->map_px, scene.shadows->map_px, GL_R32F, gl::DepthBuffer::depth),
      hull_depth_(view_.recon.width_px, view_.recon.height_px, GL_R32F) {
  const geometry::Pinhole pinhole = config::shadow_map_pinhole(*scene.shadows);
  clip_from_light_ = geometry::gl_clip_from_camera(pinhole, view_.near_m, view_.far_m);
  light_clip_from_world_ = clip_from_light_ * view_.fixed->matrix();
  focal_ = pinhole.fx_px / pinhole.width_px;
  tolerance_ = kTolerance_px / pinhole.fx_px;
  hull_tolerance_ =
      std::max(tolerance_, kHullTolerance_px / std::min(view_.recon.fx_px, view_.recon.fy_px));
}

void ShadowMap::draw(const DrawObjects& draw_objects, const HullFrame* hull) {
  framebuffer_.bind();
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);
  const float farthest = 1, nothing[4] = {0, 0, 0, 0};
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  glClearBufferfv(GL_COLOR, 0, nothing);
  object_program_.use();
  draw_objects(object_program_, light_clip_from_world_);
  if (hull && !hull->depth_m.empty() && !hull->covered.empty()) draw_hull(*hull);
}

void ShadowMap::draw_hull(const HullFrame& hull) {
  hull_depth_.upload(GL_RED, GL_FLOAT, hull.depth_m.data());
  hull_program_.use();
  hull_program_.set("depth_m", kHullUnit);
  hull_program_.set("window_depth_terms",
                    Eigen::Vector2f(float(clip_from_light_(2, 2)), float(clip_from_light_(2, 3))));
  hull_depth_.bind(kHullUnit);
  no_attributes_.bind();
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

}  // namespace fivepipe::render
