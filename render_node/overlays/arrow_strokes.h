// Arrows in the world as triangles of the image, with widths in pixels.
#pragma once
#include <span>
#include <vector>

#include "render_node/overlays/overlay_shapes.h"

namespace fivepipe::render {

// A corner of a triangle in normalised device coordinates. The vertex buffer has this layout.
struct StrokeCorner {
  Eigen::Vector3f p_ndc;
  Eigen::Vector3f rgb;
};

// The view in which the arrows are drawn.
struct StrokeView {
  Eigen::Isometry3d eye_from_world;
  Eigen::Matrix4d clip_from_eye;  // geometry::gl_clip_from_camera()
  double near_m;                  // depth of the near plane
  double width_px, height_px;     // of the image
  double lift_m;                  // the strokes are this much nearer to the eye than the arrows
};

// Returns the triangles of the arrows, three corners each. The shafts are shaft_px wide; all edges
// are margin_px farther out. Skips the part of an arrow that is nearer than near_m, and arrows
// shorter than a pixel in the image.
std::vector<StrokeCorner> strokes(std::span<const Arrow> arrows, const StrokeView& view,
                                  double shaft_px, double margin_px);

// Length and half the width of an arrow's head, in widths of the shaft.
inline constexpr double kHeadLength = 5, kHeadHalfWidth = 2.5;

}  // namespace fivepipe::render
