#include "render_node/overlays/overlay_painter.h"

#include <algorithm>
#include <cassert>

#include "common/geometry/gl_camera.h"
#include "render_node/overlays/shaders_embedded.h"

namespace fivepipe::render {
namespace {

// Sizes are multiples of the width of an arrow's shaft, which is 2 pixels in an image of 480 rows
// and at least 1 pixel.
constexpr double kUnitsPerHeight = 240;
constexpr double kPointDiameter = 2.5, kProximityDiameter = 3, kEndDiameter = 5;
// Dark outlines make the marks stand out on bright surfaces.
constexpr double kOutline = 0.5;

}  // namespace

OverlayPainter::DiscLayer::DiscLayer() {
  vertex_array.attribute(0, buffer, 3, sizeof(Disc), offsetof(Disc, p_world_m));
  vertex_array.attribute(1, buffer, 3, sizeof(Disc), offsetof(Disc, rgb));
}

OverlayPainter::OverlayPainter(const config::Scene& scene, const config::Viewer& viewer)
    : pinhole_(config::render_pinhole(viewer)),
      near_m_(viewer.near_m),
      unit_px_(std::max(1.0, pinhole_.height_px / kUnitsPerHeight)),
      clip_from_eye_(geometry::gl_clip_from_camera(pinhole_, viewer.near_m, viewer.far_m)),
      disc_program_("overlay discs", overlay_shaders::kDiscVert, overlay_shaders::kDiscFrag),
      stroke_program_("overlay arrows", overlay_shaders::kStrokeVert,
                      overlay_shaders::kStrokeFrag) {
  for (auto& [name, overlaid] : overlaid_objects(scene)) {
    const Eigen::Isometry3d& world_from_object = scene.objects[overlaid.object].world_from_object;
    objects_.emplace(name, PlacedObject{overlaid, world_from_object, overlaid.mesh.vertices_m});
  }
  for (const config::SceneObject& object : scene.objects) name_of_object_.push_back(object.name);
  stroke_array_.attribute(0, stroke_buffer_, 3, sizeof(StrokeCorner),
                          offsetof(StrokeCorner, p_ndc));
  stroke_array_.attribute(1, stroke_buffer_, 3, sizeof(StrokeCorner), offsetof(StrokeCorner, rgb));
}

const OverlaidObject* OverlayPainter::find(const std::string& object) const {
  const auto found = objects_.find(object);
  return found == objects_.end() ? nullptr : &found->second.overlaid;
}

void OverlayPainter::place(const std::string& object, const Eigen::Isometry3d& world_from_object,
                           std::span<const float> vertices_m) {
  const auto found = objects_.find(object);
  if (found == objects_.end() || found->second.vertices_m.empty()) return;
  PlacedObject& placed = found->second;
  placed.world_from_object = world_from_object;
  assert(vertices_m.empty() || vertices_m.size() == 3 * placed.vertices_m.size());
  for (std::size_t i = 0; i < vertices_m.size() / 3; ++i)
    placed.vertices_m[i] = Eigen::Map<const Eigen::Vector3f>(&vertices_m[3 * i]).cast<double>();
}

OverlayShapes OverlayPainter::shapes_of(std::span<const CollisionMarks> marks) const {
  OverlayShapes shapes;
  for (const CollisionMarks& of_object : marks) {
    const PlacedObject& placed = objects_.at(name_of_object_.at(of_object.object));
    const auto places_world_m = of_object.proximity.empty()
                                    ? std::vector<Eigen::Vector3f>()
                                    : proximity_places_world_m(placed.overlaid, placed.vertices_m,
                                                               placed.world_from_object);
    add_shapes(of_object, places_world_m, shapes);
  }
  return shapes;
}

void OverlayPainter::upload(const OverlayShapes& shapes, const Eigen::Isometry3d& eye_from_world) {
  const auto upload_discs = [](const std::vector<Disc>& discs, DiscLayer& layer) {
    layer.count = int(discs.size());
    if (!discs.empty())
      layer.buffer.upload(discs.data(), discs.size() * sizeof(Disc), GL_STREAM_DRAW);
  };
  upload_discs(shapes.proximity, proximity_);
  upload_discs(shapes.points, points_);
  upload_discs(shapes.ends, ends_);
  const StrokeView view{eye_from_world,
                        clip_from_eye_,
                        near_m_,
                        double(pinhole_.width_px),
                        double(pinhole_.height_px),
                        kLift_m};
  std::vector<StrokeCorner> corners = strokes(shapes.arrows, view, unit_px_, kOutline * unit_px_);
  outline_corners_ = int(corners.size());
  const std::vector<StrokeCorner> arrows = strokes(shapes.arrows, view, unit_px_, 0);
  corners.insert(corners.end(), arrows.begin(), arrows.end());
  stroke_corners_ = int(corners.size());
  if (!corners.empty())
    stroke_buffer_.upload(corners.data(), corners.size() * sizeof(StrokeCorner), GL_STREAM_DRAW);
}

void OverlayPainter::draw_discs(const DiscLayer& layer, double diameter_px, bool hidden) const {
  if (layer.count == 0) return;
  disc_program_.use();
  disc_program_.set("is_hidden", int(hidden));
  layer.vertex_array.bind();
  const auto draw_with = [&](double px, bool is_outline) {
    disc_program_.set("is_outline", int(is_outline));
    disc_program_.set("diameter_px", float(px));
    glDrawArrays(GL_POINTS, 0, layer.count);
  };
  if (!hidden) draw_with(diameter_px + 2 * kOutline * unit_px_, true);
  draw_with(diameter_px, false);
}

void OverlayPainter::draw_arrows(bool hidden) const {
  if (stroke_corners_ == 0) return;
  stroke_program_.use();
  stroke_program_.set("is_hidden", int(hidden));
  stroke_array_.bind();
  if (!hidden) {
    stroke_program_.set("is_outline", 1);
    glDrawArrays(GL_TRIANGLES, 0, outline_corners_);
  }
  stroke_program_.set("is_outline", 0);
  glDrawArrays(GL_TRIANGLES, outline_corners_, stroke_corners_ - outline_corners_);
}

void OverlayPainter::draw(std::size_t eye, const Eigen::Isometry3d& eye_from_world,
                          std::span<const CollisionMarks> marks) {
  const int left_px = int(eye) * pinhole_.width_px;
  glViewport(left_px, 0, pinhole_.width_px, pinhole_.height_px);
  glScissor(left_px, 0, pinhole_.width_px, pinhole_.height_px);
  glEnable(GL_SCISSOR_TEST);  // the viewport does not clip discs
  upload(shapes_of(marks), eye_from_world);
  disc_program_.use();
  disc_program_.set("eye_from_world", Eigen::Matrix4f(eye_from_world.matrix().cast<float>()));
  disc_program_.set("clip_from_eye", Eigen::Matrix4f(clip_from_eye_.cast<float>()));
  disc_program_.set("near_m", float(near_m_));
  disc_program_.set("lift_m", float(kLift_m));
  glEnable(GL_PROGRAM_POINT_SIZE);
  glDepthMask(GL_FALSE);
  for (const bool hidden : {true, false}) {
    glDepthFunc(hidden ? GL_GREATER : GL_LEQUAL);
    draw_discs(proximity_, kProximityDiameter * unit_px_, hidden);
    draw_discs(points_, kPointDiameter * unit_px_, hidden);
    draw_discs(ends_, kEndDiameter * unit_px_, hidden);
    draw_arrows(hidden);
  }
  glDepthMask(GL_TRUE);
  glDisable(GL_PROGRAM_POINT_SIZE);
  glDisable(GL_SCISSOR_TEST);
}

}  // namespace fivepipe::render
