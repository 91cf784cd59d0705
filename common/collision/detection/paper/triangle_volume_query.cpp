#include "common/collision/detection/paper/triangle_volume_query.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "common/collision/detection/paper/shaders_embedded.h"
#include "common/geometry/gl_camera.h"

namespace fivepipe::collision {
namespace {

constexpr std::size_t kMaxCameras = 255;  // maximum of an 8-bit stencil
constexpr int kPosition = 0, kTextureCoordinate = 1;

int checked_viewport(int window_px, int viewport_px) {
  if (!(viewport_px > 0 && viewport_px <= window_px))
    throw std::invalid_argument("viewport of " + std::to_string(viewport_px) +
                                " px does not fit a window of " + std::to_string(window_px) +
                                " px");
  return viewport_px;
}

gl::GlTexture texture_for(const hull::ObjectPixels& pixels) {
  return {std::max(1, 2 * pixels.words_per_row()), std::max(1, pixels.height_px()), GL_R32UI};
}

}  // namespace

TriangleVolumeQuery::TriangleVolumeQuery(int window_px, int viewport_px)
    : window_px_(window_px),
      viewport_px_(checked_viewport(window_px, viewport_px)),
      program_("triangle volume query", kTriangleVert, kTriangleFrag),
      window_(window_px, window_px, GL_R8, gl::DepthBuffer::depth_and_stencil) {}

void TriangleVolumeQuery::set_silhouettes(std::span<const hull::Silhouette> silhouettes,
                                          const hull::HullRule& rule) {
  if (silhouettes.size() > kMaxCameras)
    throw std::invalid_argument("more than 255 cameras, the limit of the 8-bit stencil");
  for (const hull::Silhouette& s : silhouettes)
    if (s.pixels.width_px() != s.camera.pinhole.width_px ||
        s.pixels.height_px() != s.camera.pinhole.height_px)
      throw std::invalid_argument("an object-pixel map and its pinhole differ in size");
  silhouettes_.assign(silhouettes.begin(), silhouettes.end());
  rule_ = rule;
  hull_is_empty_ = silhouettes.empty() ||
                   (rule.limits == hull::Limits::all &&
                    std::any_of(silhouettes.begin(), silhouettes.end(),
                                [](const hull::Silhouette& s) { return s.pixels.count() == 0; }));
  if (hull_is_empty_) return;
  for (std::size_t i = 0; i < silhouettes.size(); ++i) {
    const hull::ObjectPixels& pixels = silhouettes[i].pixels;
    if (i == object_pixels_.size())
      object_pixels_.push_back(texture_for(pixels));
    else if (object_pixels_[i].width_px() != 2 * pixels.words_per_row() ||
             object_pixels_[i].height_px() != pixels.height_px())
      object_pixels_[i] = texture_for(pixels);
    // A 64-bit word is two 32-bit texels, the low one first: requires a little-endian host.
    object_pixels_[i].upload(GL_RED_INTEGER, GL_UNSIGNED_INT, pixels.words().data());
  }
}

TriangleQueryResult TriangleVolumeQuery::query(std::span<const Triangle> triangles) {
  for (const Triangle& t : triangles)
    if (!(t[0].allFinite() && t[1].allFinite() && t[2].allFinite()))
      throw std::invalid_argument("a vertex of a triangle is not finite");
  TriangleQueryResult result;
  if (hull_is_empty_) return result;
  const std::size_t capacity = columns() * columns();
  for (std::size_t first = 0; first < triangles.size(); first += capacity)
    query_window(triangles.subspan(first, std::min(capacity, triangles.size() - first)), first,
                 result);
  return result;
}

void TriangleVolumeQuery::draw(std::span<const TriangleView> views) {
  const auto ndc = [&](double window_px) { return float(2 * window_px / window_px_ - 1); };
  std::vector<float> positions, texture_coordinates;
  positions.reserve(views.size() * 6);
  texture_coordinates.reserve(views.size() * silhouettes_.size() * 9);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double x_px = double(i % columns()) * viewport_px_,
                 y_px = double(i / columns()) * viewport_px_;
    positions.insert(positions.end(),
                     {ndc(x_px), ndc(y_px), ndc(x_px + viewport_px_), ndc(y_px),
                      ndc(x_px + views[i].apex_x * viewport_px_), ndc(y_px + viewport_px_)});
  }
  // Projects in double on the CPU: far from the origin, float coordinates are coarser than a pixel.
  for (const hull::Silhouette& s : silhouettes_) {
    const Eigen::Matrix<double, 3, 4> texture_from_world =
        geometry::texture_from_camera(s.camera.pinhole) * s.camera.camera_from_world.matrix();
    for (const TriangleView& view : views)
      for (const Eigen::Vector3d* p_world_m :
           {&view.base0_world_m, &view.base1_world_m, &view.apex_world_m}) {
        const Eigen::Vector3f stq = (texture_from_world * p_world_m->homogeneous()).cast<float>();
        texture_coordinates.insert(texture_coordinates.end(), {stq.x(), stq.y(), stq.z()});
      }
  }
  positions_.upload(positions.data(), positions.size() * sizeof(float), GL_STREAM_DRAW);
  texture_coordinates_.upload(texture_coordinates.data(),
                              texture_coordinates.size() * sizeof(float), GL_STREAM_DRAW);

  window_.bind();
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glDisable(GL_SCISSOR_TEST);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glEnable(GL_STENCIL_TEST);
  glStencilMask(0xff);
  glClearNamedFramebufferfi(window_.get(), GL_DEPTH_STENCIL, 0, 1.0f, 0);
  glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
  program_.use();
  program_.set("object_pixels", 0);
  vertices_.attribute(kPosition, positions_, 2, 2 * sizeof(float), 0);
  const bool all = rule_.limits == hull::Limits::all;
  for (std::size_t i = 0; i < silhouettes_.size(); ++i) {
    // all: counts only fragments that all earlier cameras counted. The final count n is the same,
    // and fewer fragments are shaded.
    glStencilFunc(all ? GL_EQUAL : GL_ALWAYS, GLint(i), 0xff);
    draw_camera(i, 3 * views.size(), true);
  }
  if (!all) {
    glStencilOp(GL_KEEP, GL_KEEP, GL_ZERO);
    for (std::size_t i = 0; i < silhouettes_.size(); ++i) draw_camera(i, 3 * views.size(), false);
  }
  glDisable(GL_STENCIL_TEST);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

void TriangleVolumeQuery::draw_camera(std::size_t camera, std::size_t vertex_count,
                                      bool on_object) {
  vertices_.attribute(kTextureCoordinate, texture_coordinates_, 3, 3 * sizeof(float),
                      int(camera * vertex_count * 3 * sizeof(float)));
  vertices_.bind();
  object_pixels_[camera].bind(0);
  const geometry::Pinhole& pinhole = silhouettes_[camera].camera.pinhole;
  program_.set("size_px", Eigen::Vector2f(float(pinhole.width_px), float(pinhole.height_px)));
  program_.set("on_object", int(on_object));
  glDrawArrays(GL_TRIANGLES, 0, GLsizei(vertex_count));
}

void TriangleVolumeQuery::query_window(std::span<const Triangle> triangles, std::size_t first,
                                       TriangleQueryResult& result) {
  std::vector<TriangleView> views;
  views.reserve(triangles.size());
  for (const Triangle& triangle : triangles) {
    views.push_back(view_of(triangle));
    result.triangles_degenerate += views.back().degenerate;
  }
  draw(views);

  const std::size_t used_rows_px =
      (views.size() + columns() - 1) / columns() * std::size_t(viewport_px_);
  stencil_.resize(std::size_t(window_px_) * used_rows_px);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, window_px_, GLsizei(used_rows_px), GL_STENCIL_INDEX, GL_UNSIGNED_BYTE,
               stencil_.data());

  const int cameras = int(silhouettes_.size()),
            needed = rule_.limits == hull::Limits::all ? cameras : std::max(rule_.min_seen, 1);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::uint8_t* viewport =
        &stencil_[(i / columns() * viewport_px_) * window_px_ + i % columns() * viewport_px_];
    for (int row = 0; row < viewport_px_; ++row)
      for (int column = 0; column < viewport_px_; ++column) {
        if (viewport[std::size_t(row) * window_px_ + column] < needed) continue;
        const Eigen::Vector3d p_world_m =
            point_at(views[i], (column + 0.5) / viewport_px_, (row + 0.5) / viewport_px_);
        if (!rule_.within_world_m.contains(p_world_m)) continue;
        if (hull::in_hull(silhouettes_, p_world_m, rule_))
          result.points.push_back({p_world_m, std::uint32_t(first + i)});
        else
          ++result.points_unconfirmed;
      }
  }
}

}  // namespace fivepipe::collision
