// Walks one ray through one coverage map in double and finds its parts with a coverage of at least
// one half.
//
// The walk visits cells between four pixel centres: cell (a, b) is between pixels a - 1 and a, and
// b - 1 and b. It skips cells without a corner at or above one half in boxes, as ray_walk.h does.
// In a cell the coverage is bilinear, so along the ray's image, which is a line, it is quadratic in
// the line's parameter. The roots are closed-form and are mapped to ray parameters by the
// cross-ratio.
#pragma once
#include "common/hull/cpu/ray_walk.h"
#include "common/hull/silhouette/coverage.h"

namespace fivepipe::hull {

// Returns the camera whose pixels are the cells of a coverage map: one more per axis, shifted by
// half a pixel.
geometry::Camera cell_camera(const geometry::Camera& camera);
// The cells of a coverage map by their four corners: with at least one at or above one half, and
// with all of them.
struct CellsOfMap {
  ObjectPixels any, all;
};
CellsOfMap cells_of(const CoverageMap& map);
// Returns true if the ray is inside of the coverage at t and just after it, because the cell there
// has all corners at or above one half: the interpolant is then above one half in the cell and on
// its border. The line is the ray's image in the cells' camera. If it returns false, the ray may
// still be inside.
inline bool is_in_whole_cell(const ImageLine& line, const ObjectPixels& all, double t) {
  const double w = line.w_offset + t * line.w_slope;
  if (!(w > kNearestToCamera_m)) return false;
  const double u = (line.u_offset + t * line.u_slope) / w,
               v = (line.v_offset + t * line.v_slope) / w;
  // The image begins and ends half a cell inside of the cells.
  return u >= 0.5 && v >= 0.5 && u < all.width_px() - 0.5 && v < all.height_px() - 0.5 &&
         all.contains(int(u), int(v));
}

class CoverageWalk {
 public:
  // The line is the ray's image in the cells' camera. `map` and `skip_map` must outlive the walk.
  // skip_map is that of cells_with_object(map) and has the quadrant into which the line moves.
  CoverageWalk(const ImageLine& line, const CoverageMap& map, const SkipMap& skip_map,
               const RayRange& range);

  struct VerdictSpan {
    bool inside;
    double end;  // > t; kNever: to the end of the ray
  };
  // Returns the verdict just after t. t must be in the range and not decrease from call to call.
  VerdictSpan verdict_at(double t) {
    while (!(t < verdict_span_.end)) walk_to(t);
    return verdict_span_;
  }
  // Returns the first parameter of the range at which the ray is in front of the camera and in its
  // image. This is not a border of the coverage.
  double begin() const { return inside_image_.begin; }

 private:
  struct ImagePoint {
    double u, v, w;  // w: the camera's depth [m]
  };
  ImagePoint at(double t) const;
  void walk_to(double t);
  void step_over_border(double t);
  void enter(double t);
  void cut_cell(double t);
  void select_piece(double t);

  ImageLine line_;
  const CoverageMap* map_;
  const SkipMap* skip_map_;
  RayRange inside_image_;
  bool right_, down_, leaves_by_u_ = false;
  PixelRect box_;  // the cells around the ray; if it has more than one, all are empty
  int u_ = 0, v_ = 0;
  double leaves_box_ = -kNever;
  // Quadratic of (coverage - one half) along the image, from the entry of the ray into the cell (0)
  // to its exit (1); and the ends of the pieces between the roots.
  double constant_ = 0, linear_ = 0, square_ = 0;
  double cut_at_[4] = {}, cut_t_[4] = {};
  int cuts_ = 0;
  VerdictSpan verdict_span_;
};

}  // namespace fivepipe::hull
