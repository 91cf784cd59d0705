// Walks one ray through one coverage map in double, up to where its coverage is at least one half.
//
// The walk visits cells between four pixel centres: cell (a, b) is between pixels a - 1 and a, and
// b - 1 and b. It skips cells without a corner at or above one half in boxes, as ray_walk.h does.
// In a cell the coverage is bilinear in the image, where the ray is a line, so along the line it is
// quadratic. The ray's parameter follows from the position on the line in closed form.
#pragma once
#include "common/hull/coverage/sparse_coverage.h"
#include "common/hull/cpu/ray_walk.h"

namespace fivepipe::hull {

// Returns the camera whose pixels are the cells of a coverage map: one more per axis, shifted by
// half a pixel.
geometry::Camera cell_camera(const geometry::Camera& camera);
// The cells of a coverage map by their four corners: with at least one at or above one half, and
// with all of them.
struct CellsOfMap {
  ObjectPixels any, all;
};
// half_covered: the pixels at or above one half.
CellsOfMap cells_of(const ObjectPixels& half_covered);

struct CoverageEntry {
  // The first parameter just after which the ray is inside of all silhouettes, or kNever. If it is
  // not resolved, the ray is outside of one of them up to there.
  double t;
  // Index of the silhouette that the ray enters there; -1: the ray starts in the hull, or the image
  // of a camera begins there.
  std::int32_t camera;
  bool resolved;
};

// A coverage map, prepared for walks.
struct WalkedMap {
  WalkedMap() = default;
  WalkedMap(const SparseCoverageMap& map, const ObjectPixels& half_covered,
            ObjectPixels whole_cells);

  ObjectPixels whole_cells;  // CellsOfMap::all
  // Coverage of the corners of the cells of CellsOfMap::any, row by row. Beside the image it is
  // that of the nearest pixel.
  PixelRect corners;
  std::vector<std::uint8_t> coverage;
};

// A coverage this close to one half may be on either side, by rounding [1/510]: 100 times the
// rounding of a bilinear form of 8-bit values in an image of 10,000 px.
inline constexpr double kUncertainSide = 1e-8;

class CoverageWalk {
 public:
  // map_from_view is that of the cells' camera. skip_map is that of CellsOfMap::any and has the
  // quadrants of the view's rays. Both maps must outlive the walk.
  CoverageWalk(const MapFromView& map_from_view, const WalkedMap& map, const SkipMap& skip_map);
  // Selects the rays through a row of the view's pixels, and then one of them.
  void set_row(double v_px) {
    for (int i = 0; i < 3; ++i)
      slope_of_row_[i] = map_from_view_.at_infinity(i, 1) * v_px + map_from_view_.at_infinity(i, 2);
  }
  void set_ray(double u_px, const RayRange& range) {
    line_.u_slope = map_from_view_.at_infinity(0, 0) * u_px + slope_of_row_[0];
    line_.v_slope = map_from_view_.at_infinity(1, 0) * u_px + slope_of_row_[1];
    line_.w_slope = map_from_view_.at_infinity(2, 0) * u_px + slope_of_row_[2];
    range_ = range;
    begin_ = range.begin;
    has_started_ = false;
  }

  // Returns the first parameter >= t just after which the ray is in the coverage, or kNever. t must
  // be in the range and not decrease from call to call.
  double next_inside(double t) {
    const ImagePoint p = at(t);
    // At most points the ray is far inside of most silhouettes.
    return is_in_whole_cell(p) ? t : walk(t, p);
  }
  // Returns the first parameter of the range at which the ray is in front of the camera and in its
  // image, which is not a border of the coverage. Requires that next_inside() returned another
  // parameter than the one it was given.
  double begin() const { return begin_; }

 private:
  struct ImagePoint {
    double u, v, w;  // w: the camera's depth [m]
  };
  ImagePoint at(double t) const {
    const double w = line_.w_offset + t * line_.w_slope, per_w = 1 / w;
    return {(line_.u_offset + t * line_.u_slope) * per_w,
            (line_.v_offset + t * line_.v_slope) * per_w, w};
  }
  // The image begins and ends half a cell inside of the cells.
  bool is_in_image(const ImagePoint& p) const {
    return p.w > kNearestToCamera_m && p.u >= 0.5 && p.v >= 0.5 && p.u < end_u_ && p.v < end_v_;
  }
  // Returns true if the cell has all corners at or above one half: the interpolant is then above
  // one half in the cell and on its border. If it returns false, the ray may be inside.
  bool is_in_whole_cell(const ImagePoint& p) const {
    if (!is_in_image(p)) return false;
    const int u = int(p.u);
    return whole_[std::ptrdiff_t(int(p.v)) * words_per_row_ + (u >> 6)] >> (u & 63) & 1;
  }
  double walk(double t, ImagePoint p);
  void start(double t, const ImagePoint& p);
  int extent(Quadrant ahead, int u, int v) const;
  double entry_in_cell(int u, int v, double s, double end) const;
  double s_of(double t) const {
    return (t - t0_) / (start_.w * (line_.w_offset + t * line_.w_slope));
  }
  // The relative error of t - t0 is the rounding times W(t) / W(t0). It is large only if the range
  // begins at the camera's centre.
  double t_of(double s) const {
    return t0_ + s * start_.w * start_.w / (1 - s * start_.w * line_.w_slope);
  }

  MapFromView map_from_view_;
  const WalkedMap* map_;
  const SkipMap* skip_map_;
  const std::uint64_t* whole_;
  int words_per_row_;
  double end_u_, end_v_;  // of the image
  double slope_of_row_[3] = {};

  ImageLine line_{};
  RayRange range_{};
  double begin_ = 0;
  bool has_started_ = false, right_ = false, down_ = false;
  // The image at parameter t is start_ + s (du_, dv_) with s = (t - t0_) / (start_.w W(t)). The
  // ray ends or leaves the image at s_end_.
  ImagePoint start_{};
  double t0_ = 0, du_ = 0, dv_ = 0, per_du_ = 0, per_dv_ = 0, s_end_ = 0;
};

// Walks through the maps of all cameras. Returns a resolved entry.
CoverageEntry next_entry(std::span<CoverageWalk> walks, const RayRange& range);

}  // namespace fivepipe::hull
