// Baseline: the response as the paper computes it (section 4.3, figure 3). A volume query renders
// each of the triangles ABC and DAE into a whole window. CP_hull and I, J, K, L are the first
// pixels in the hull, from the base along V_rec and along the edges.
//
// TriangleVolumeQuery aligns the rows of pixels with a triangle's longest edge AB, so V_rec is
// inclined to them by half the apex angle. In each column, the pixel nearest to V_rec is used, at
// most half a row away: 11 um for the paper's triangle of 5 cm.
#pragma once
#include <optional>
#include <span>

#include "common/collision/detection/paper/triangle_volume_query.h"

namespace fivepipe::baselines {

struct RenderedExit {
  double d_rec_m = 0;
  Eigen::Vector3d cp_hull_world_m;
  std::optional<Eigen::Vector3d> normal_world;  // empty if IJ and KL are parallel
};

// Needs a current OpenGL context.
class RenderedResponse {
 public:
  explicit RenderedResponse(int window_px) : query_(window_px, window_px), window_px_(window_px) {}
  void set_silhouettes(std::span<const hull::Silhouette> silhouettes) {
    query_.set_silhouettes(silhouettes);
  }

  // Searches from CP_obj along the unit vector V_rec; BC is height_m away. Returns nullopt if the
  // base is in the hull.
  std::optional<RenderedExit> respond(const Eigen::Vector3d& cp_object_world_m,
                                      const Eigen::Vector3d& v_rec_world, double height_m,
                                      double apex_angle_rad);

 private:
  collision::TriangleVolumeQuery query_;
  int window_px_;
};

}  // namespace fivepipe::baselines
