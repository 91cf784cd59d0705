// Draws the virtual scene and composites the reconstructed hull into it by depth (paper,
// sections 3.3 and 4.4.1: the parent pipe).
#pragma once
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/config/scene.h"
#include "common/gl/objects.h"
#include "render_node/materials/material_parts.h"
#include "render_node/particle_points.h"
#include "render_node/shadow_map.h"
#include "render_node/surface.h"
#include "render_node/views/tile_assembler.h"

namespace fivepipe::render {

// The current pose, shape and warmth of a virtual object.
struct ObjectPose {
  std::string object;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  std::vector<float> vertices_m;  // x y z per vertex, object frame; empty if the object is rigid
  std::vector<float> warmth;      // 0 .. 1 per vertex; empty keeps the previous values
};

// Needs a current GL context from construction to destruction.
class Renderer {
 public:
  // Loads the textures of the scene. Throws config::ConfigError if one is unusable (SceneTextures),
  // and gl::GlError.
  Renderer(const config::Scene& scene, const config::Viewer& viewer);

  // Draws one frame: the images of the viewer's eyes side by side, the left eye's at the left. An
  // eye has the pose of its hull. An object without a pose in `poses` keeps its last pose.
  // Colliding objects are tinted red. Virtual and real surfaces occlude each other per pixel; at
  // equal depth the virtual surface is visible. The poses and particles must be drawable.
  // light_hull: the hull in config::light_view(), which casts shadows; null: it casts none.
  // Leaves the framebuffer of the image bound, so that OverlayPainter can draw into it.
  void draw(std::span<const HullFrame> eyes, std::span<const ObjectPose> poses,
            const std::set<std::string>& colliding, std::span<const ParticleCloud> particles = {},
            const HullFrame* light_hull = nullptr);
  // The same for a viewer with one eye.
  void draw(const HullFrame& hull, std::span<const ObjectPose> poses,
            const std::set<std::string>& colliding, std::span<const ParticleCloud> particles = {},
            const HullFrame* light_hull = nullptr) {
    draw(std::span(&hull, 1), poses, colliding, particles, light_hull);
  }

  // Returns why draw() cannot draw the pose, or nullopt: unknown object, wrong number of vertices
  // or warmth values, a non-finite pose or vertex, or warmth for an object without `warmth` in the
  // scene.
  std::optional<std::string> why_undrawable(const ObjectPose& pose) const;
  // The same for particles: unknown source, more than config::kMaxSentParticles, a coordinate that
  // is not finite, or not three per particle.
  std::optional<std::string> why_undrawable(const ParticleCloud& particles) const;

  // Waits until the GPU has finished the last frame.
  void finish() const;
  // Reads back the last frame: 8-bit BGR (sRGB), row 0 at the top.
  cv::Mat image_bgr() const;
  // Reads back the depth of the last frame along the view's z [m], 32-bit float; far_m at pixels
  // that show only the background. For tests.
  cv::Mat depth_m() const;

 private:
  struct DrawableObject {
    DrawableObject(const config::SceneObject& object, const SceneTextures& textures);
    config::SceneObject object;
    Surface surface;
    Eigen::AlignedBox3d bounds_m;  // of the mesh as loaded, object frame
    Eigen::Isometry3d world_from_object;
    gl::GlBuffer corners, warmth;  // per corner; warmth is unused if the object has no `warming`
    gl::GlVertexArray vertex_array;
    std::vector<MaterialPart> parts;
    std::optional<gl::GlBuffer> corners_uv;  // present if a part has a texture
  };

  void set_pose(const ObjectPose& pose);
  void draw_shadow_map(const HullFrame* light_hull);
  void draw_eye(const HullFrame& hull, const std::set<std::string>& colliding,
                std::span<const ParticleCloud> particles);
  void draw_triangles(const DrawableObject& drawn) const;
  void set_view(const gl::GlProgram& program, const Eigen::Isometry3d& eye_from_world) const;
  void draw_hull(const HullFrame& hull);
  void upload(const HullFrame& hull);
  void draw_objects(const Eigen::Isometry3d& eye_from_world,
                    const std::set<std::string>& colliding) const;
  bool can_cull_back_faces(const DrawableObject& drawn,
                           const Eigen::Isometry3d& eye_from_world) const;
  std::vector<std::size_t> front_to_back(const Eigen::Isometry3d& eye_from_world) const;
  void draw_particles(const Eigen::Isometry3d& eye_from_world,
                      std::span<const ParticleCloud> particles);
  void draw_background() const;

  geometry::Pinhole pinhole_;
  double near_m_, far_m_, near_corner_m_;
  Eigen::Matrix4d clip_from_eye_;
  Eigen::Vector3d light_world_m_;
  double light_reach_m_;
  std::array<double, 3> background_rgb_;
  SceneTextures textures_;
  std::vector<DrawableObject> objects_;
  std::map<std::string, std::size_t> index_of_object_;
  bool lights_real_objects_;
  std::optional<ShadowMap> shadow_map_;  // present if the scene has shadows
  std::vector<config::ParticleSource> sources_;
  std::optional<ParticlePoints> particle_points_;         // present if the scene has a source
  std::map<std::string, gl::GlProgram> object_programs_;  // by the result of material_features()
  gl::GlProgram coloured_hull_program_, grey_hull_program_, background_program_;
  gl::GlFramebuffer framebuffer_;
  gl::GlVertexArray no_attributes_;
  std::optional<gl::GlTexture> hull_depth_, hull_bgr_;
};

}  // namespace fivepipe::render
