// The edge bins of image-based visual hulls (Matusik, Buehler, Raskar, Gortler, McMillan 2000,
// section 3.1.2): a silhouette's border edges, listed by the epipolar lines that they cross, so
// that a ray tests only its candidates.
#pragma once
#include <cstdint>
#include <vector>

#include "common/hull/hull.h"
#include "common/hull/map_from_view.h"

namespace fivepipe::baselines {

// Map coordinates here are pixels from a corner near the center of the object pixels' bounds (a
// whole number of pixels, so that borders are whole numbers). `a` is the axis along which a
// sector's lines advance (x or y), `b` the other.
//
// A sector is a pencil of epipolar lines. Line number s is
//   b = s * (p0 + p1 a) + (q0 + q1 a), with p0 + p1 a > 0.
// With b_h, a_h, w homogeneous, b_h - q0 w - q1 a_h and p0 w + p1 a_h vanish at the epipole. Their
// quotient at the ray's vanishing point is the ray's s; their quotient at an edge's ends determines
// the edge's bins, for every position of the epipole.
struct Sector {
  bool advances_along_y;
  float p0, p1, q0, q1;
  // +1 or -1: the sign of da/dt. All positions along lines are multiplied by it, so that they grow
  // with depth.
  float towards;
  float s_begin, s_end, steps_per_s;
  int first_bin, bins;

  float s_of(float a, float b) const { return (b - q0 - q1 * a) / (p0 + p1 * a); }
};

// An edge as a list entry: border * 2 + (1 if it runs along the sector's axis a, else 0). The
// border of an edge across a is multiplied by `towards`. It has 16 bits, so that one load reads
// two; silhouettes are therefore limited to less than 32,000 px in width and height.
using PackedEdge = std::int16_t;
// Nearer than any edge; pads lists of odd length. Positions along lines are clamped to at least
// kMinPosition.
inline constexpr PackedEdge kNoEdge = -32768;
inline constexpr float kMinPosition = -16383;

// Lines are distinguished in steps of 1 / kStepsPerBin of a bin, some millionths of a pixel, which
// is the resolution of float. Ends of edges and rays are rounded alike, so that no ray passes
// between two edges that meet.
inline constexpr int kStepBits = 15;
inline constexpr std::int32_t kStepsPerBin = 1 << kStepBits;

inline constexpr int kGroupBits = 3, kGroupBins = 1 << kGroupBits;

// Bin `empty_bin` is empty and serves rays that meet no edge.
class EpipolarBins {
 public:
  // There must be object pixels; `map` belongs to the silhouette's camera. Keeps its buffers.
  void build(const hull::Silhouette& silhouette, const hull::PixelRect& bounds,
             const hull::MapFromView& map);

  // The border (pixel corner) at which map coordinates are 0.
  int origin_u_px() const { return origin_u_px_; }
  int origin_v_px() const { return origin_v_px_; }
  const std::vector<Sector>& sectors() const { return sectors_; }
  int empty_bin() const { return bins_; }

  // The edges that every line of bin k crosses: pairs [whole_first[k], whole_first[k + 1]) of
  // whole.
  const std::vector<std::int32_t>& whole_first() const { return whole_first_; }
  const std::vector<PackedEdge>& whole() const { return whole_; }
  // The edges that some lines of bin k cross: [part_first[k], part_first[k + 1]) of part. Lines
  // from step part_steps & 0xffff of the bin up to, but not including, part_steps >> 16 cross the
  // edge.
  const std::vector<std::int32_t>& part_first() const { return part_first_; }
  const std::vector<std::int32_t>& part() const { return part_; }
  const std::vector<std::uint32_t>& part_steps() const { return part_steps_; }
  // Every list may be read up to the length of the longest.

  // For a far epipole: the nearest and the farthest position of the edges of each group of
  // kGroupBins bins, so that the rays of a tile (a range of lines) can be skipped or start late
  // together. Level l has groups() entries; entry g holds the extremes over the groups [g, g + 2^l)
  // (fewer at the end), infinite if there is no edge. groups() is 0 for a near epipole.
  int groups() const { return groups_; }
  const std::vector<float>& nearest() const { return nearest_; }
  const std::vector<float>& farthest() const { return farthest_; }

  // Whether lines end in an object pixel: the epipole is on one, and the images of rays run
  // towards it.
  bool ends_inside() const { return ends_inside_; }

 private:
  struct Placed {
    PackedEdge edge;
    std::int32_t begin, end;  // steps, from the first of all bins
    float nearest, farthest;  // positions of its ends
  };
  void choose_sectors(const hull::PixelRect& bounds, const Eigen::Vector3d& epipole);
  void collect_edges(const hull::ObjectPixels& pixels, const hull::PixelRect& bounds);
  void place(bool vertical, int border, int begin, int end);
  void place(const Sector& sector, bool vertical, int border, int begin, int end);
  void fill();
  void find_extents();

  int origin_u_px_ = 0, origin_v_px_ = 0, bins_ = 0, groups_ = 0;
  bool ends_inside_ = false, epipole_is_near_ = false;
  std::vector<Sector> sectors_;
  std::vector<Placed> placed_;
  std::vector<int> run_begin_;  // by column: where the current vertical border run began
  std::vector<std::uint64_t> above_, vertical_above_;
  std::vector<std::int32_t> whole_first_, part_first_, whole_next_, part_next_, part_;
  std::vector<PackedEdge> whole_;
  std::vector<std::uint32_t> part_steps_;
  std::vector<float> nearest_, farthest_;
};

}  // namespace fivepipe::baselines
