#include "render_node/renderer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "common/geometry/gl_camera.h"
#include "common/gl/shader_source.h"
#include "render_node/extents.h"
#include "render_node/shaders/shaders_embedded.h"

namespace fivepipe::render {
namespace {

constexpr int kDepthUnit = 0, kColourUnit = 1, kShadowUnit = 2, kTextureUnit = 3;

// Two neighbouring pixels of the reconstruction belong to one surface if it is tilted by less than
// 80 degrees against the image plane: tan(80 degrees) = 5.7.
constexpr float kMaxTiltTangent = 5.7f;

const Eigen::Vector3d kUncolouredHull(0.55, 0.55, 0.55);  // linear RGB

// Returns the #define line of the programs whose surfaces receive shadows.
std::string shadow_features(const config::Scene& scene) {
  return scene.shadows ? "#define SHADOWED\n" : "";
}
// Returns the #define lines of a program that draws the hull.
std::string hull_features(const config::Scene& scene, bool is_coloured) {
  return (is_coloured ? "#define COLOURED\n" : "") +
         std::string(scene.lights_real_objects ? "#define LIT\n" + shadow_features(scene) : "");
}

gl::GlProgram program(const std::string& name, const std::string& features,
                      const std::string& vertex_source, const std::string& fragment_source) {
  return {name, gl::with_defines(vertex_source, features),
          gl::with_defines(fragment_source, features)};
}

bool finite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); });
}

}  // namespace

Renderer::DrawableObject::DrawableObject(const config::SceneObject& o,
                                         const SceneTextures& textures)
    : object(o),
      surface(o),
      bounds_m(fivepipe::geometry::bounds_m(config::mesh_of(o))),
      world_from_object(o.world_from_object),
      parts(material_parts(o, surface.triangles(), textures)) {
  const std::vector<SurfaceCorner> rest = surface.corners();
  corners.upload(rest.data(), rest.size() * sizeof(SurfaceCorner), GL_STATIC_DRAW);
  vertex_array.attribute(0, corners, 3, sizeof(SurfaceCorner), offsetof(SurfaceCorner, p_object_m));
  vertex_array.attribute(1, corners, 3, sizeof(SurfaceCorner), offsetof(SurfaceCorner, normal));
  vertex_array.attribute(2, corners, 2, sizeof(SurfaceCorner), offsetof(SurfaceCorner, pattern_m));
  if (std::ranges::any_of(parts, [](const MaterialPart& part) { return part.texture; })) {
    const auto& uv = std::get<config::MeshShape>(object.shape).materials->corners_uv;
    corners_uv.emplace();
    corners_uv->upload(uv.data(), uv.size() * sizeof uv[0], GL_STATIC_DRAW);
    vertex_array.attribute(4, *corners_uv, 2, sizeof uv[0], 0);
  }
  if (!object.warming) return;  // a disabled attribute is 0
  const std::vector<float> cold(rest.size(), 0.0f);
  warmth.upload(cold.data(), cold.size() * sizeof(float), GL_STREAM_DRAW);
  vertex_array.attribute(3, warmth, 1, sizeof(float), 0);
}

Renderer::Renderer(const config::Scene& scene, const config::Viewer& viewer)
    : pinhole_(config::render_pinhole(viewer)),
      near_m_(viewer.near_m),
      far_m_(viewer.far_m),
      near_corner_m_(near_corner_m(pinhole_, near_m_)),
      clip_from_eye_(geometry::gl_clip_from_camera(pinhole_, near_m_, far_m_)),
      light_world_m_(scene.light_world_m),
      light_reach_m_(light_reach_m(scene)),
      background_rgb_(scene.background_rgb),
      textures_(scene),
      lights_real_objects_(scene.lights_real_objects),
      sources_(scene.particles),
      coloured_hull_program_(program("coloured hull", hull_features(scene, true),
                                     shaders::kHullVert, shaders::kHullFrag)),
      grey_hull_program_(
          program("hull", hull_features(scene, false), shaders::kHullVert, shaders::kHullFrag)),
      background_program_(
          program("background", "", shaders::kBackgroundVert, shaders::kBackgroundFrag)),
      framebuffer_(config::composite_width_px(viewer), pinhole_.height_px, GL_RGBA8,
                   gl::DepthBuffer::depth) {
  if (scene.shadows) shadow_map_.emplace(scene);
  if (!sources_.empty()) particle_points_.emplace(shadow_features(scene));
  objects_.reserve(scene.objects.size());
  for (const config::SceneObject& object : scene.objects) {
    index_of_object_[object.name] = objects_.size();
    objects_.emplace_back(object, textures_);
    for (const MaterialPart& part : objects_.back().parts)
      if (const std::string features = material_features(object, part);
          !object_programs_.contains(features))
        object_programs_.emplace(features,
                                 program("virtual object", features + shadow_features(scene),
                                         shaders::kObjectVert, shaders::kObjectFrag));
  }
}

void Renderer::draw(std::span<const HullFrame> eyes, std::span<const ObjectPose> poses,
                    const std::set<std::string>& colliding,
                    std::span<const ParticleCloud> particles, const HullFrame* light_hull) {
  assert(int(eyes.size()) * pinhole_.width_px == framebuffer_.colour().width_px());
  for (const ObjectPose& pose : poses) {
    assert(!why_undrawable(pose));
    set_pose(pose);
  }

  if (shadow_map_) draw_shadow_map(light_hull);
  framebuffer_.bind();
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);
  glEnable(GL_SCISSOR_TEST);  // the viewport does not clip the squares of particles
  for (std::size_t i = 0; i < eyes.size(); ++i) {
    const int left_px = int(i) * pinhole_.width_px;
    glViewport(left_px, 0, pinhole_.width_px, pinhole_.height_px);
    glScissor(left_px, 0, pinhole_.width_px, pinhole_.height_px);
    draw_eye(eyes[i], colliding, particles);
  }
  glDisable(GL_SCISSOR_TEST);
}

// Draws into the viewport.
void Renderer::draw_eye(const HullFrame& hull, const std::set<std::string>& colliding,
                        std::span<const ParticleCloud> particles) {
  const float farthest = 1;
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  // Draw roughly front to back, so that the depth test skips the shading of hidden pixels.
  if (!hull.depth_m.empty() && !hull.covered.empty()) draw_hull(hull);
  draw_objects(hull.eye_from_world, colliding);
  draw_particles(hull.eye_from_world, particles);
  draw_background();
}

std::optional<std::string> Renderer::why_undrawable(const ObjectPose& pose) const {
  const auto found = index_of_object_.find(pose.object);
  if (found == index_of_object_.end()) return "not in the scene";
  if (!pose.world_from_object.matrix().allFinite()) return "pose not finite";
  const DrawableObject& drawn = objects_[found->second];
  if (!pose.warmth.empty() && !drawn.object.warming)
    return "warmth for an object without warmth in the scene";
  if (!pose.warmth.empty() && pose.warmth.size() != drawn.surface.vertices())
    return std::to_string(pose.warmth.size()) + " values of warmth for a mesh of " +
           std::to_string(drawn.surface.vertices()) + " vertices";
  if (!std::all_of(pose.warmth.begin(), pose.warmth.end(),
                   [](float w) { return w >= 0 && w <= 1; }))
    return "warmth outside 0 .. 1";
  if (pose.vertices_m.empty()) return {};
  if (pose.vertices_m.size() != 3 * drawn.surface.vertices())
    return std::to_string(pose.vertices_m.size()) + " vertex coordinates for a mesh of " +
           std::to_string(drawn.surface.vertices()) + " vertices";
  if (!finite(pose.vertices_m)) return "vertex not finite";
  return {};
}

std::optional<std::string> Renderer::why_undrawable(const ParticleCloud& particles) const {
  if (particles.source >= sources_.size()) return "not in the scene";
  if (particles.p_world_m.size() % 3 != 0)
    return std::to_string(particles.p_world_m.size()) + " coordinates are not three per particle";
  if (double(particles.p_world_m.size()) > 3 * config::kMaxSentParticles)
    return std::to_string(particles.p_world_m.size() / 3) + " particles are too many";
  if (!finite(particles.p_world_m)) return "particle not finite";
  return {};
}

void Renderer::set_pose(const ObjectPose& pose) {
  DrawableObject& drawn = objects_[index_of_object_.at(pose.object)];
  drawn.world_from_object = pose.world_from_object;
  if (!pose.warmth.empty()) {
    const std::vector<float> corners = drawn.surface.at_corners(pose.warmth);
    drawn.warmth.upload(corners.data(), corners.size() * sizeof(float), GL_STREAM_DRAW);
  }
  if (pose.vertices_m.empty()) return;
  const std::vector<SurfaceCorner> moved = drawn.surface.corners(pose.vertices_m);
  drawn.corners.upload(moved.data(), moved.size() * sizeof(SurfaceCorner), GL_STREAM_DRAW);
}

void Renderer::draw_shadow_map(const HullFrame* light_hull) {
  const auto draw_objects_in_light = [&](const gl::GlProgram& object_program,
                                         const Eigen::Matrix4d& light_clip_from_world) {
    for (const DrawableObject& drawn : objects_) {
      object_program.set(
          "light_clip_from_object",
          Eigen::Matrix4f(
              (light_clip_from_world * drawn.world_from_object.matrix()).cast<float>()));
      draw_triangles(drawn);
    }
  };
  shadow_map_->draw(draw_objects_in_light, light_hull);
  shadow_map_->texture().bind(kShadowUnit);
}

void Renderer::draw_triangles(const DrawableObject& drawn) const {
  drawn.vertex_array.bind();
  glDrawArrays(GL_TRIANGLES, 0, GLsizei(3 * drawn.surface.triangles()));
}

void Renderer::set_view(const gl::GlProgram& program,
                        const Eigen::Isometry3d& eye_from_world) const {
  program.set("clip_from_eye", Eigen::Matrix4f(clip_from_eye_.cast<float>()));
  program.set("light_eye_m", Eigen::Vector3f((eye_from_world * light_world_m_).cast<float>()));
  program.set("up_eye",
              Eigen::Vector3f((eye_from_world.linear() * Eigen::Vector3d::UnitZ()).cast<float>()));
  program.set("light_reach_m", float(light_reach_m_));
  program.set("window_depth_terms",
              Eigen::Vector2f(float(clip_from_eye_(2, 2)), float(clip_from_eye_(2, 3))));
  if (!shadow_map_) return;
  program.set("shadow_map", kShadowUnit);
  program.set("light_focal", float(shadow_map_->focal()));
  program.set("shadow_tolerance", float(shadow_map_->tolerance()));
  program.set(
      "light_from_eye",
      Eigen::Matrix4f(
          (shadow_map_->light_from_world() * eye_from_world.inverse()).matrix().cast<float>()));
}

void Renderer::draw_hull(const HullFrame& hull) {
  upload(hull);
  const geometry::Pinhole& k = hull.recon;
  const gl::GlProgram& hull_program =
      hull.bgr.empty() ? grey_hull_program_ : coloured_hull_program_;
  hull_program.use();
  set_view(hull_program, hull.eye_from_world);
  if (shadow_map_) hull_program.set("shadow_tolerance", float(shadow_map_->hull_tolerance()));
  hull_program.set("covered_px",
                   Eigen::Vector4f(float(hull.covered.u0_px), float(hull.covered.v0_px),
                                   float(hull.covered.u1_px), float(hull.covered.v1_px)));
  hull_program.set("focal_px", Eigen::Vector2f(float(k.fx_px), float(k.fy_px)));
  hull_program.set("center_px", Eigen::Vector2f(float(k.cx_px), float(k.cy_px)));
  hull_program.set("max_tilt_tangent", kMaxTiltTangent);
  hull_program.set("grey", Eigen::Vector3f(kUncolouredHull.cast<float>()));
  hull_program.set("depth_m", kDepthUnit);
  hull_program.set("bgr", kColourUnit);
  hull_depth_->bind(kDepthUnit);
  hull_bgr_->bind(kColourUnit);
  no_attributes_.bind();
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

// Uploads the covered rectangle and a border of one pixel, which the shader samples.
void Renderer::upload(const HullFrame& hull) {
  const geometry::Pinhole& k = hull.recon;
  if (!hull_depth_ || hull_depth_->width_px() != k.width_px ||
      hull_depth_->height_px() != k.height_px) {
    hull_depth_.emplace(k.width_px, k.height_px, GL_R32F);
    // Light is computed from linear colours; otherwise the colours stay as they are.
    hull_bgr_.emplace(k.width_px, k.height_px, lights_real_objects_ ? GL_SRGB8 : GL_RGB8);
  }
  const hull::PixelRect& c = hull.covered;
  const hull::PixelRect part = hull::intersection(
      {c.u0_px - 1, c.v0_px - 1, c.u1_px + 1, c.v1_px + 1}, {0, 0, k.width_px, k.height_px});
  const std::size_t first =
      std::size_t(part.v0_px) * std::size_t(k.width_px) + std::size_t(part.u0_px);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, k.width_px);
  hull_depth_->upload(part.u0_px, part.v0_px, part.width_px(), part.height_px(), GL_RED, GL_FLOAT,
                      hull.depth_m.data() + first);
  if (!hull.bgr.empty())
    hull_bgr_->upload(part.u0_px, part.v0_px, part.width_px(), part.height_px(), GL_BGR,
                      GL_UNSIGNED_BYTE, hull.bgr.data() + 3 * first);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
}

void Renderer::draw_objects(const Eigen::Isometry3d& eye_from_world,
                            const std::set<std::string>& colliding) const {
  for (const auto& [features, object_program] : object_programs_)
    set_view(object_program, eye_from_world);
  for (const std::size_t index : front_to_back(eye_from_world)) {
    const DrawableObject& drawn = objects_[index];
    (can_cull_back_faces(drawn, eye_from_world) ? glEnable : glDisable)(GL_CULL_FACE);
    drawn.vertex_array.bind();
    for (const MaterialPart& part : drawn.parts) {
      const gl::GlProgram& object_program =
          object_programs_.at(material_features(drawn.object, part));
      object_program.use();
      set_material(object_program, drawn.object, part, colliding.contains(drawn.object.name),
                   kTextureUnit);
      object_program.set(
          "eye_from_object",
          Eigen::Matrix4f((eye_from_world * drawn.world_from_object).matrix().cast<float>()));
      glDrawArrays(GL_TRIANGLES, GLint(3 * part.first_triangle), GLsizei(3 * part.triangles));
    }
  }
  glDisable(GL_CULL_FACE);
}

// Returns true for a closed convex surface that the near plane does not cut within the view. Its
// back faces are hidden, and drawing one before the front face would shade the pixel twice.
bool Renderer::can_cull_back_faces(const DrawableObject& drawn,
                                   const Eigen::Isometry3d& eye_from_world) const {
  if (!std::holds_alternative<config::BoxShape>(drawn.object.shape) &&
      !std::holds_alternative<config::SphereShape>(drawn.object.shape))
    return false;
  const Eigen::Vector3d eye_object_m =
      (eye_from_world * drawn.world_from_object).inverse().translation();
  return drawn.bounds_m.exteriorDistance(eye_object_m) > near_corner_m_;
}

// Returns object indices sorted by the farthest distance of the bounding sphere from the eye.
// Floors and walls are last, because other objects hide parts of them.
std::vector<std::size_t> Renderer::front_to_back(const Eigen::Isometry3d& eye_from_world) const {
  std::vector<std::pair<double, std::size_t>> by_end;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const DrawableObject& drawn = objects_[i];
    const Eigen::Vector3d centre_eye_m =
        eye_from_world * drawn.world_from_object * drawn.bounds_m.center();
    by_end.emplace_back(centre_eye_m.norm() + 0.5 * drawn.bounds_m.diagonal().norm(), i);
  }
  std::sort(by_end.begin(), by_end.end());
  std::vector<std::size_t> order;
  for (const auto& [end_m, index] : by_end) order.push_back(index);
  return order;
}

void Renderer::draw_particles(const Eigen::Isometry3d& eye_from_world,
                              std::span<const ParticleCloud> particles) {
  if (particles.empty()) return;
  const gl::GlProgram& program = particle_points_->program();
  program.use();
  set_view(program, eye_from_world);
  program.set("eye_from_world", Eigen::Matrix4f(eye_from_world.matrix().cast<float>()));
  for (const ParticleCloud& cloud : particles) {
    assert(!why_undrawable(cloud));
    const config::ParticleSource& source = sources_[cloud.source];
    particle_points_->draw(cloud.p_world_m, source.radius_m, pinhole_.fy_px,
                           linear_from_srgb(source.colour_rgb).cast<float>());
  }
}

// Draws a vertical gradient around the scene's background colour, darker at the bottom, at depth 1.
void Renderer::draw_background() const {
  const Eigen::Vector3d background(background_rgb_[0], background_rgb_[1], background_rgb_[2]);
  background_program_.use();
  background_program_.set("bottom", Eigen::Vector3f((0.8 * background).cast<float>()));
  background_program_.set("top", Eigen::Vector3f((1.2 * background).cast<float>()));
  no_attributes_.bind();
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void Renderer::finish() const {
  glFinish();
  gl::check_context();
}

cv::Mat Renderer::image_bgr() const {
  cv::Mat rgba(pinhole_.height_px, framebuffer_.colour().width_px(), CV_8UC4),
      image(rgba.size(), CV_8UC3);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.get());
  glReadPixels(0, 0, rgba.cols, rgba.rows, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data);
  gl::check_context();
  for (int v = 0; v < image.rows; ++v) {  // GL's rows count from the bottom
    cv::Mat row = image.row(v);
    cv::cvtColor(rgba.row(rgba.rows - 1 - v), row, cv::COLOR_RGBA2BGR);
  }
  return image;
}

cv::Mat Renderer::depth_m() const {
  cv::Mat window_depth(pinhole_.height_px, framebuffer_.colour().width_px(), CV_32F),
      depth(window_depth.size(), CV_32F);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.get());
  glReadPixels(0, 0, depth.cols, depth.rows, GL_DEPTH_COMPONENT, GL_FLOAT, window_depth.data);
  for (int v = 0; v < depth.rows; ++v)
    std::transform(window_depth.ptr<float>(depth.rows - 1 - v),
                   window_depth.ptr<float>(depth.rows - 1 - v) + depth.cols, depth.ptr<float>(v),
                   [&](float window) {
                     return float(geometry::depth_m_from_window_depth(window, near_m_, far_m_));
                   });
  return depth;
}

}  // namespace fivepipe::render
