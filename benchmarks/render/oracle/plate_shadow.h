// The shadow of a square plate on a wall in closed form, and the scene in which the renderer draws
// it. The eye is at the origin and its view is along world y; wall and plate face it. The shadow is
// a square.
#pragma once
#include <opencv2/core/mat.hpp>

#include "common/config/deployment.h"
#include "render_node/views/tile_assembler.h"

namespace fivepipe::render::plate_shadow {

inline constexpr double kWall_m = 2, kOccluder_m = 1;  // depths of the plates' fronts
inline const Eigen::Vector3d kLight_m(-0.5, 0.1, 0.3);
// Half of the occluder's edges, and its centre.
inline constexpr double kHalf_m = 0.12;
inline const Eigen::Vector3d kOccluderCenter_m(0.1, kOccluder_m, -0.05);

config::ShadowView shadow_view();
config::Scene scene(bool with_shadows, bool with_occluder = true);
Eigen::Isometry3d eye_from_world();
// The hull of a plate in the occluder's place, as the light of scene(true) sees it, moved by
// `moved_m`.
HullFrame occluder_in_light(const Eigen::Vector3d& moved_m = Eigen::Vector3d::Zero());

// The point of the wall that the pixel shows.
Eigen::Vector3d on_wall_m(const geometry::Pinhole& image, double u_px, double v_px);
// Returns true if the occluder hides the light from this point of the wall.
bool is_shadowed(const Eigen::Vector3d& p_world_m);
// Returns true if the pixel shows the occluder, or is within 3 mm of it there.
bool shows_occluder(const geometry::Pinhole& image, int u_px, int v_px);
// Returns true if the pixel is dark: below two thirds of its brightness without shadows.
bool is_dark(const cv::Mat& lit_bgr, const cv::Mat& drawn_bgr, int u_px, int v_px);

// How far the drawn shadow's edge is from the closed form.
struct EdgeError {
  double mean_px;   // area between the two edges, divided by the edge's length
  double worst_px;  // largest distance of a wrong pixel's centre from the edge of the closed form
  int shadowed_px;  // pixels in the shadow by the closed form
};
// lit, drawn: the image without and with shadows. has_occluder: of the scene.
EdgeError edge_error(const cv::Mat& lit_bgr, const cv::Mat& drawn_bgr,
                     const geometry::Pinhole& image, bool has_occluder);

// Edge of a pixel of the shadow map of virtual objects on the wall, in pixels of the image.
double map_pixel_px(const geometry::Pinhole& image);

}  // namespace fivepipe::render::plate_shadow
