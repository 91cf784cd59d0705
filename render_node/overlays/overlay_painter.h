// Draws the overlays of a scene over the composite.
#pragma once
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/config/view/viewer.h"
#include "common/gl/objects.h"
#include "render_node/overlays/arrow_strokes.h"
#include "render_node/overlays/overlay_shapes.h"

namespace fivepipe::render {

// Needs a current GL context from construction to destruction.
class OverlayPainter {
 public:
  OverlayPainter(const config::Scene& scene, const config::Viewer& viewer);

  // Returns the object of this name if the overlays show something of it, otherwise null.
  const OverlaidObject* find(const std::string& object) const;

  // Sets the pose of an object, and its vertices (x y z each, object frame) if there are any; they
  // stay until the next call. Ignores objects of which no proximity is shown.
  void place(const std::string& object, const Eigen::Isometry3d& world_from_object,
             std::span<const float> vertices_m);

  // Draws the marks over the composite of eye number `eye`, as seen from eye_from_world. Call it
  // after Renderer::draw(), whose framebuffer holds the composites of the eyes side by side, and
  // their depths, which do not change. Parts that a surface hides by more than kLift_m are faint:
  // every second pixel of them is drawn. marks: of objects that find() returns.
  void draw(std::size_t eye, const Eigen::Isometry3d& eye_from_world,
            std::span<const CollisionMarks> marks);

 private:
  struct PlacedObject {
    OverlaidObject overlaid;
    Eigen::Isometry3d world_from_object;
    std::vector<Eigen::Vector3d> vertices_m;  // object frame
  };
  // Discs of one size.
  struct DiscLayer {
    DiscLayer();
    gl::GlBuffer buffer;
    gl::GlVertexArray vertex_array;
    int count = 0;
  };

  OverlayShapes shapes_of(std::span<const CollisionMarks> marks) const;
  void upload(const OverlayShapes& shapes, const Eigen::Isometry3d& eye_from_world);
  void draw_discs(const DiscLayer& layer, double diameter_px, bool hidden) const;
  void draw_arrows(bool hidden) const;

  geometry::Pinhole pinhole_;
  double near_m_, unit_px_;
  Eigen::Matrix4d clip_from_eye_;
  std::map<std::string, PlacedObject> objects_;
  std::vector<std::string> name_of_object_;  // by the index in the scene
  gl::GlProgram disc_program_, stroke_program_;
  DiscLayer proximity_, points_, ends_;
  gl::GlBuffer stroke_buffer_;  // the outlines of all arrows, then the arrows
  gl::GlVertexArray stroke_array_;
  int outline_corners_ = 0, stroke_corners_ = 0;
};

// A surface hides a mark that is farther than this behind it. A disc faces the eye, so half of one
// on a tilted surface is behind it: at 45 degrees by its radius, which is 9 mm at 1 m for the
// widest disc.
inline constexpr double kLift_m = 0.01;

}  // namespace fivepipe::render
