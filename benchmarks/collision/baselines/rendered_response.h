// Rival: the response as the paper computes it (section 4.3, figure 3): the triangles ABC and DAE
// volume-queried in a whole window each; CP_hull and I, J, K, L are the first of the window's
// pixels in the hull from the base on along V_rec and the edges.
//
// V_rec leans by half of the apex angle against the rows of pixels: TriangleVolumeQuery lays a
// triangle's longest edge along them, AB. Of each column the pixel nearest to V_rec is taken, at
// most half a row from it: 11 um for the paper's triangle of 5 cm.
#pragma once
#include <optional>
#include <span>

#include "common/collision/detection/paper/triangle_volume_query.h"

namespace fivepipe::baselines {

struct RenderedExit {
  double d_rec_m = 0;
  Eigen::Vector3d cp_hull_world_m;
  std::optional<Eigen::Vector3d> normal_world;  // not where IJ and KL span no plane
};

// Needs a current OpenGL context.
class RenderedResponse {
 public:
  explicit RenderedResponse(int window_px) : query_(window_px, window_px), window_px_(window_px) {}
  void set_silhouettes(std::span<const hull::Silhouette> silhouettes) {
    query_.set_silhouettes(silhouettes);
  }

  // From CP_obj along a unit direction; BC lies height_m from it. Nothing where the base is in the
  // hull.
  std::optional<RenderedExit> respond(const Eigen::Vector3d& cp_object_world_m,
                                      const Eigen::Vector3d& v_rec_world, double height_m,
                                      double apex_angle_rad);

 private:
  collision::TriangleVolumeQuery query_;
  int window_px_;
};

}  // namespace fivepipe::baselines
