// Draws the virtual scene and composites the reconstruction into it by depth (paper, sections 3.3
// and 4.4.1: the parent pipe).
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
#include "render_node/surface.h"
#include "render_node/tile_assembler.h"

namespace fivepipe::render {

// Where a virtual object is now.
struct ObjectPose {
  std::string object;
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  std::vector<float> vertices_m;  // x y z per vertex of its mesh, object frame; empty: rigid
  std::vector<float> warmth;      // 0 .. 1 per vertex of its mesh; empty: as it was
};

// Needs a current GL context for its whole life.
class Renderer {
 public:
  Renderer(const config::Scene& scene, const config::Viewer& viewer);

  // Draws one frame as seen from hull.eye_from_world. Objects stay where the last pose put them.
  // What can't be drawn (unknown object, wrong number of vertices, non-finite pose or vertex,
  // warmth of what is not warmed) leaves its object as it was and is said in the answer, one line
  // each. Colliding objects are tinted red. Virtual and real surfaces occlude each other pixel by
  // pixel; at equal depth the virtual one is seen.
  std::vector<std::string> draw(const HullFrame& hull, std::span<const ObjectPose> poses,
                                const std::set<std::string>& colliding);

  // Waits until the frame drawn last is finished.
  void finish() const;
  // The frame drawn last, read back: 8-bit BGR (sRGB), row 0 at the top.
  cv::Mat image_bgr() const;
  // Its depth along the view's z [m], 32-bit float; far_m where there is nothing.
  cv::Mat depth_m() const;

 private:
  struct DrawableObject {
    explicit DrawableObject(const config::SceneObject& object);
    config::SceneObject object;
    Surface surface;
    Eigen::AlignedBox3d bounds_m;  // of the mesh as loaded, object frame
    Eigen::Isometry3d world_from_object;
    gl::GlBuffer corners, warmth;  // per corner; warmth: where the object is warmed
    gl::GlVertexArray vertex_array;
  };

  std::optional<std::string> why_undrawable(const ObjectPose& pose) const;
  void set_pose(const ObjectPose& pose);
  void set_view(const gl::GlProgram& program, const Eigen::Isometry3d& eye_from_world) const;
  void draw_hull(const HullFrame& hull);
  void upload(const HullFrame& hull);
  void draw_objects(const Eigen::Isometry3d& eye_from_world,
                    const std::set<std::string>& colliding) const;
  bool can_cull_back_faces(const DrawableObject& drawn,
                           const Eigen::Isometry3d& eye_from_world) const;
  std::vector<std::size_t> front_to_back(const Eigen::Isometry3d& eye_from_world) const;
  void draw_background() const;

  geometry::Pinhole pinhole_;
  double near_m_, far_m_, near_corner_m_;
  Eigen::Matrix4d clip_from_eye_;
  Eigen::Vector3d light_world_m_;
  double light_reach_m_;
  std::array<double, 3> background_rgb_;
  std::vector<DrawableObject> objects_;
  std::map<std::string, std::size_t> index_of_object_;
  std::map<std::string, gl::GlProgram>
      object_programs_;  // by what their objects have (features_of)
  gl::GlProgram coloured_hull_program_, grey_hull_program_, background_program_;
  gl::GlFramebuffer framebuffer_;
  gl::GlVertexArray no_attributes_;
  std::optional<gl::GlTexture> hull_depth_, hull_bgr_;
};

}  // namespace fivepipe::render
