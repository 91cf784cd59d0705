#include "benchmarks/hull/baselines/tile_range.h"

#include <algorithm>
#include <cmath>

namespace fivepipe::baselines {
namespace {

// Relative: eight roundings of float. A wider range costs time but changes no result.
constexpr double kSlack = 1e-6;

int across(const hull::PixelRect& view) { return (view.width_px() + kPiece_px - 1) / kPiece_px; }

}  // namespace

DepthRange range_of_rays(std::span<const hull::HalfSpace> half_spaces, const hull::PixelRect& rays,
                         const DepthRange& within) {
  const double u = 0.5 * (rays.u0_px + rays.u1_px - 1), v = 0.5 * (rays.v0_px + rays.v1_px - 1);
  const double half_u = 0.5 * (rays.width_px() - 1), half_v = 0.5 * (rays.height_px() - 1);
  DepthRange tight = within;
  for (const hull::HalfSpace& h : half_spaces) {
    // The slope is linear over the rays, so the largest one is at a corner.
    const double slope =
        h.slope_at(u, v) + std::abs(h.slope.x()) * half_u + std::abs(h.slope.y()) * half_v;
    const bool in_at_begin = h.offset + tight.begin_m * slope >= 0,
               in_at_end = h.offset + tight.end_m * slope >= 0;
    if (in_at_begin && in_at_end) continue;
    const double t = -h.offset / slope;
    if (in_at_end)
      tight.begin_m = std::max(tight.begin_m, t);
    else if (in_at_begin)
      tight.end_m = std::min(tight.end_m, t);
    else
      return {0, 0};
    if (tight.empty()) return {0, 0};
  }
  return {std::max(within.begin_m, tight.begin_m * (1 - kSlack)),
          std::min(within.end_m, tight.end_m * (1 + kSlack))};
}

int pieces_of(const hull::PixelRect& view) {
  return across(view) * ((view.height_px() + kPiece_px - 1) / kPiece_px);
}

hull::PixelRect piece_of(const hull::PixelRect& view, int piece) {
  const int u = view.u0_px + piece % across(view) * kPiece_px,
            v = view.v0_px + piece / across(view) * kPiece_px;
  return hull::intersection(view, {u, v, u + kPiece_px, v + kPiece_px});
}

}  // namespace fivepipe::baselines
