// The edge bins of image-based visual hulls (Matusik, Buehler, Raskar, Gortler, McMillan 2000, section 3.1.2): a silhouette's
// border edges, listed by the epipolar lines that they cross, so that a ray meets its candidates alone.
#pragma once
#include <cstdint>
#include <vector>

#include "common/hull/hull.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::rivals {

// Map coordinates here are pixels from a corner near the middle of the object pixels' bounds (a whole number of pixels, so that
// borders are whole numbers). `a` is the axis along which a sector's lines advance (x or y), `b` the other.
//
// A pencil of epipolar lines with one number each: its line s is b = s * (p0 + p1 a) + (q0 + q1 a), for p0 + p1 a > 0. With
// b_h, a_h, w homogeneous, b_h - q0 w - q1 a_h and p0 w + p1 a_h vanish at the epipole; their quotient at the ray's vanishing point
// is the ray's s, and the quotient at an edge's ends is what its bins follow from, wherever the epipole lies.
struct Sector {
  bool advances_along_y;
  float p0, p1, q0, q1;
  float towards;  // +1 or -1: the sign of da/dt, by which all positions along lines are multiplied, so that they grow with depth
  float s_begin, s_end, bins_per_s;
  int first_bin, bins;

  float s_of(float a, float b) const { return (b - q0 - q1 * a) / (p0 + p1 * a); }
};

// An edge as a list entry: border * 2 + (1 if it runs along the sector's axis a, else 0). The border of an edge across a is
// multiplied by `towards`.
using PackedEdge = std::int32_t;

// Four lists of bins; bin `bins` (the last) is empty, for rays that meet none.
class EpipolarBins {
 public:
  // The object pixels are not empty; `map` is of the silhouette's camera. Keeps its buffers.
  void build(const Silhouette& silhouette, const PixelRect& bounds, const MapFromView& map);

  int origin_u_px() const { return origin_u_px_; }  // border (pixel corner) at which map coordinates are 0
  int origin_v_px() const { return origin_v_px_; }
  const std::vector<Sector>& sectors() const { return sectors_; }
  int empty_bin() const { return bins_; }

  // Edges that every line of bin k crosses: whole[whole_first[k] ... whole_first[k + 1]).
  const std::vector<std::int32_t>& whole_first() const { return whole_first_; }
  const std::vector<PackedEdge>& whole() const { return whole_; }
  // Edges that lines of bin k cross where part_begin <= s < part_end.
  const std::vector<std::int32_t>& part_first() const { return part_first_; }
  const std::vector<PackedEdge>& part() const { return part_; }
  const std::vector<float>& part_begin() const { return part_begin_; }
  const std::vector<float>& part_end() const { return part_end_; }

  // Whether lines end in an object pixel: the epipole is on one, and images of rays run towards it.
  bool ends_inside() const { return ends_inside_; }

 private:
  struct Placed {
    PackedEdge edge;
    float s_begin, s_end;
    int bin_begin, bin_end;  // of the ends; before the sector's first, or one behind its last, where an end is outside
    int least_bin, end_bin;  // of the sector
  };
  void choose_sectors(const PixelRect& bounds, const Eigen::Vector3d& epipole);
  void collect_edges(const ObjectPixels& pixels, const PixelRect& bounds);
  void place(bool vertical, int border, int begin, int end);
  void place(const Sector& sector, bool vertical, int border, int begin, int end);
  void fill();

  int origin_u_px_ = 0, origin_v_px_ = 0, bins_ = 0;
  bool ends_inside_ = false, epipole_is_near_ = false;
  std::vector<Sector> sectors_;
  std::vector<Placed> placed_;
  std::vector<int> run_begin_;  // by column: where the vertical border run at hand began
  std::vector<std::int32_t> whole_first_, part_first_, whole_next_, part_next_;
  std::vector<PackedEdge> whole_, part_;
  std::vector<float> part_begin_, part_end_;
};

}  // namespace fivepipe::rivals
