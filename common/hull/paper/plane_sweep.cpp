#include "common/hull/paper/plane_sweep.h"

#include <algorithm>
#include <cassert>
#include <climits>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/geometry/gl_camera.h"
#include "common/hull/map_from_view.h"
#include "common/hull/paper/shaders_embedded.h"

namespace fivepipe::hull {
namespace {

// The z-buffer's range is larger than the sweep's by this factor, so that rounding clips no plane.
constexpr double kClipSlack = 2.0;

PixelRect bounds_of(std::span<const PixelRect> rects) {
  PixelRect all{INT_MAX, INT_MAX, INT_MIN, INT_MIN};
  for (const PixelRect& r : rects)
    if (!r.empty())
      all = {std::min(all.u0_px, r.u0_px), std::min(all.v0_px, r.v0_px),
             std::max(all.u1_px, r.u1_px), std::max(all.v1_px, r.v1_px)};
  return all;
}

Eigen::Matrix<float, 3, 4> texture_from_view(const geometry::Camera& map_camera,
                                             const geometry::Camera& view) {
  const Eigen::Matrix4d map_from_view =
      (map_camera.camera_from_world * view.camera_from_world.inverse()).matrix();
  return (geometry::texture_from_camera(map_camera.pinhole) * map_from_view).cast<float>();
}

// Shaders need not support infinity.
Eigen::Vector3f finite(const Eigen::Vector3d& p_m) {
  constexpr double kUnbounded_m = 1e30;
  return p_m.cwiseMax(-kUnbounded_m).cwiseMin(kUnbounded_m).cast<float>();
}

Eigen::Vector4f sight_corners(const geometry::Pinhole& k) {
  return Eigen::Vector4d((-0.5 - k.cx_px) / k.fx_px, (-0.5 - k.cy_px) / k.fy_px,
                         (k.width_px - 0.5 - k.cx_px) / k.fx_px,
                         (k.height_px - 0.5 - k.cy_px) / k.fy_px)
      .cast<float>();
}

}  // namespace

SweepRange sweep_range(const View& view, const Eigen::AlignedBox3d& volume_world_m) {
  double nearest = INFINITY, farthest = -INFINITY;
  for (int corner = 0; corner < 8; ++corner) {
    const double z = (view.camera.camera_from_world *
                      volume_world_m.corner(Eigen::AlignedBox3d::CornerType(corner)))
                         .z();
    nearest = std::min(nearest, z);
    farthest = std::max(farthest, z);
  }
  return {std::max(view.near_m, nearest), std::min(view.far_m, farthest)};
}

PlaneSweep::PlaneSweep(int width_px, int height_px, int planes)
    : planes_(planes),
      frame_(width_px, height_px, GL_R32F, gl::DepthBuffer::depth_and_stencil),
      count_("plane sweep: count", shaders::kPlaneVert, shaders::kCountFrag),
      keep_("plane sweep: keep", shaders::kPlaneVert, shaders::kKeepFrag) {
  assert(planes > 0);
}

void PlaneSweep::set_silhouettes(std::span<const Silhouette> silhouettes, const HullRule& rule) {
  if (silhouettes.size() > kMaxSweepCameras)
    throw std::invalid_argument("backend sweep supports at most 255 cameras, not " +
                                std::to_string(silhouettes.size()));
  hull_is_empty_ = silhouettes.empty();
  rule_ = rule;
  std::vector<MapTexture> previous = std::exchange(maps_, {});
  for (std::size_t i = 0; i < silhouettes.size(); ++i) {
    const Silhouette& s = silhouettes[i];
    const PixelRect bounds = s.pixels.bounds();
    if ((bounds.empty() && rule.limits == Limits::all) || !is_finite(s.camera)) {
      hull_is_empty_ = true;
      return;
    }
    const bool fits = i < previous.size() &&
                      previous[i].texture.width_px() == s.pixels.width_px() &&
                      previous[i].texture.height_px() == s.pixels.height_px();
    maps_.push_back({s.camera, bounds,
                     fits ? std::move(previous[i].texture)
                          : gl::GlTexture(s.pixels.width_px(), s.pixels.height_px(), GL_R8)});
    maps_.back().texture.upload(GL_RED, GL_UNSIGNED_BYTE, s.pixels.to_bytes().data());
  }
}

// OpenGL counts rows from the bottom.
void PlaneSweep::scissor(const PixelRect& r) const {
  glScissor(r.u0_px, height_px() - r.v1_px, r.width_px(), r.height_px());
}

// Clears the rects. Pixels outside all rects get window depth 0, which no plane passes.
void PlaneSweep::clear(std::span<const PixelRect> rects, const PixelRect& around) const {
  const auto clear_one = [&](const PixelRect& rect, float window_depth) {
    const float no_hull[4] = {kNoHull, 0, 0, 0};
    scissor(rect);
    glClearBufferfi(GL_DEPTH_STENCIL, 0, window_depth, 0);
    glClearBufferfv(GL_COLOR, 0, no_hull);
  };
  if (rects.size() > 1) clear_one(around, 0.0f);
  for (const PixelRect& rect : rects)
    if (!rect.empty()) clear_one(rect, 1.0f);
}

// all: each camera increments the pixels that all cameras before it have counted. A pixel that one
// of them missed cannot reach n.
void PlaneSweep::count_cameras(
    float depth_m, std::span<const Eigen::Matrix<float, 3, 4>> textures_from_view) const {
  const bool all = rule_.limits == Limits::all;
  const auto draw = [&](std::size_t camera) {
    glProgramUniformMatrix4x3fv(count_.get(), 2, 1, GL_FALSE, textures_from_view[camera].data());
    maps_[camera].texture.bind(0);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  };
  count_.use();
  glProgramUniform1f(count_.get(), 0, depth_m);
  glProgramUniform1i(count_.get(), 4, 0);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glDepthMask(GL_FALSE);
  glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
  for (std::size_t i = 0; i < maps_.size(); ++i) {
    glStencilFunc(all ? GL_EQUAL : GL_ALWAYS, GLint(i), 0xff);
    draw(i);
  }
  if (all) return;
  glProgramUniform1i(count_.get(), 4, 1);
  glStencilOp(GL_KEEP, GL_KEEP, GL_ZERO);
  for (std::size_t i = 0; i < maps_.size(); ++i) draw(i);
}

void PlaneSweep::sweep(const View& view, const SweepRange& range, const PixelRect& pixels) const {
  std::vector<HalfSpace> half_spaces;
  std::vector<Eigen::Matrix<float, 3, 4>> textures_from_view;
  for (const MapTexture& m : maps_) {
    if (rule_.limits == Limits::all)
      add_half_spaces(map_from_view(m.camera, view.camera), m.bounds, half_spaces);
    textures_from_view.push_back(texture_from_view(m.camera, view.camera));
  }
  const Eigen::Matrix4f clip_from_view =
      geometry::gl_clip_from_camera(view.camera.pinhole, range.near_m / kClipSlack,
                                    range.far_m * kClipSlack)
          .cast<float>();
  const Eigen::Vector4f corners = sight_corners(view.camera.pinhole);
  for (const gl::GlProgram* program : {&count_, &keep_}) {
    glProgramUniformMatrix4fv(program->get(), 1, 1, GL_FALSE, clip_from_view.data());
    glProgramUniform4fv(program->get(), 3, 1, corners.data());
  }
  add_half_spaces(view_rays(view.camera), rule_.within_world_m, half_spaces);
  const Eigen::Matrix<float, 3, 4> world_from_view =
      view.camera.camera_from_world.inverse().matrix().topRows<3>().cast<float>();
  const Eigen::Vector3f box_min_m = finite(rule_.within_world_m.min()),
                        box_max_m = finite(rule_.within_world_m.max());
  glProgramUniformMatrix4x3fv(count_.get(), 5, 1, GL_FALSE, world_from_view.data());
  glProgramUniform3fv(count_.get(), 6, 1, box_min_m.data());
  glProgramUniform3fv(count_.get(), 7, 1, box_max_m.data());
  const bool all = rule_.limits == Limits::all;
  const GLint needed = all ? GLint(maps_.size()) : std::max(rule_.min_seen, 1);
  for (int k = 0; k < planes_; ++k) {
    const double depth_m = range.near_m + k * (range.far_m - range.near_m) / planes_;
    const PixelRect reached = pixels_at_depth(half_spaces, depth_m, pixels);
    if (reached.empty()) continue;
    scissor(reached);
    count_cameras(float(depth_m), textures_from_view);
    // Pixels that enough cameras cover get the plane's depth. All counts return to zero.
    keep_.use();
    glProgramUniform1f(keep_.get(), 0, float(depth_m));
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
    glStencilFunc(all ? GL_EQUAL : GL_LEQUAL, needed, 0xff);
    glStencilOp(GL_ZERO, GL_ZERO, GL_ZERO);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  }
}

DepthTile PlaneSweep::read_back(const PixelRect& rect) const {
  DepthTile tile{rect, std::vector<float>(rect.area_px())};
  if (rect.empty()) return tile;
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(rect.u0_px, height_px() - rect.v1_px, rect.width_px(), rect.height_px(), GL_RED,
               GL_FLOAT, tile.depth_m.data());
  const int width = rect.width_px(), height = rect.height_px();
  for (int v = 0; v < height / 2; ++v)
    std::swap_ranges(tile.depth_m.begin() + std::ptrdiff_t(v) * width,
                     tile.depth_m.begin() + std::ptrdiff_t(v + 1) * width,
                     tile.depth_m.begin() + std::ptrdiff_t(height - 1 - v) * width);
  return tile;
}

std::vector<DepthTile> PlaneSweep::depth(const View& view, const SweepRange& range,
                                         std::span<const PixelRect> rects) const {
  assert(view.camera.pinhole.width_px == width_px() &&
         view.camera.pinhole.height_px == height_px());
  std::vector<DepthTile> tiles;
  const PixelRect around = bounds_of(rects);
  if (hull_is_empty_ || around.empty() || !is_finite(view.camera) ||
      !(range.near_m > 0 && range.far_m > range.near_m && std::isfinite(range.far_m))) {
    for (const PixelRect& rect : rects)
      tiles.push_back({rect, std::vector<float>(rect.area_px(), kNoHull)});
    return tiles;
  }
  frame_.bind();
  no_attributes_.bind();
  glEnable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_STENCIL_TEST);
  glDepthFunc(GL_LESS);
  clear(rects, around);
  sweep(view, range, around);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_STENCIL_TEST);
  for (const PixelRect& rect : rects) tiles.push_back(read_back(rect));
  return tiles;
}

}  // namespace fivepipe::hull
