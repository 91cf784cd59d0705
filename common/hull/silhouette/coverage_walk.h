// One ray through one coverage map, in double: where its coverage is at or above one half.
//
// The map is walked in cells between four pixel centres, cell (a, b) between pixels a - 1 and a, b
// - 1 and b; those without a corner at or above one half are skipped in boxes, as in ray_walk.h.
// Over a cell the coverage is bilinear in the image, so along the ray's image, a line, a quadratic
// in the image's own parameter: closed-form roots, taken back to the ray by the cross-ratio.
#pragma once
#include "common/hull/cpu/ray_walk.h"
#include "common/hull/silhouette/coverage.h"

namespace fivepipe::hull {

// The camera in whose pixels the cells of a coverage map are: one more each way, half a pixel on.
geometry::Camera cell_camera(const geometry::Camera& camera);
// The cells that may hold something: one of the four corners is at or above one half.
ObjectPixels cells_with_object(const CoverageMap& map);

class CoverageWalk {
 public:
  // The line is that of the cells' camera. Borrows the map, and the skip_map of its cells with the
  // box ahead of the line made.
  CoverageWalk(const ImageLine& line, const CoverageMap& map, const SkipMap& skip_map,
               const RayRange& range);

  struct VerdictSpan {
    bool inside;
    double end;  // > t; kNever: to the end
  };
  // Just after t, which never decreases from call to call, and is in the range.
  VerdictSpan verdict_at(double t) {
    while (!(t < verdict_span_.end)) walk_to(t);
    return verdict_span_;
  }
  // Where the ray comes into the image, or in front of the camera, or the range begins: the
  // coverage has no border there.
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
  void take_piece(double t);

  ImageLine line_;
  const CoverageMap* map_;
  const SkipMap* skip_map_;
  RayRange inside_image_;
  bool right_, down_, leaves_by_u_ = false;
  PixelRect box_;  // of cells, in which the ray is; where it has more than one, all are empty
  int u_ = 0, v_ = 0;
  double leaves_box_ = -kNever;
  // Of a cell in pieces: coverage less one half along the image from where it was entered (0) to
  // where it is left (1), and its pieces' ends.
  double constant_ = 0, linear_ = 0, square_ = 0;
  double cut_at_[4] = {}, cut_t_[4] = {};
  int cuts_ = 0;
  VerdictSpan verdict_span_;
};

}  // namespace fivepipe::hull
