#include <algorithm>
#include <array>
#include <cmath>

#include "common/hull/cpu/ray_simd.h"
#include "common/hull/cpu/ray_walk.h"

namespace fivepipe::hull {
namespace {

// The SIMD code computes byte offsets in a quadrant in float, which is exact up to here.
constexpr std::size_t kMaxBoxBytes = std::size_t{1} << 24;

// Bounds of float's roundings in the computation of a position, in units of half an ulp (2^-24). A
// form (U, V or W) rounds its coefficients once, adds two steps to the ray and one along it; the
// bound is relative to the sum of the sizes of its terms. A quotient rounds the reciprocal (on the
// worst target) and the product; the bound is relative to the position.
constexpr double kFormError = 4, kQuotientError = 6, kHalfUlp = 0x1p-24;

// Offsets of the last column and row of a block, rounded up to whole tiles: the rays at the corners
// then bound all rays of the tiles.
struct LastRay {
  int right, down;
};
LastRay last_ray(const PixelRect& rays) {
  const auto last = [](int size) { return (size + kTile_px - 1) / kTile_px * kTile_px - 1; };
  return {last(rays.width_px()), last(rays.height_px())};
}

// Returns true if the image of every corner ray moves left (axis 0) or up (axis 1). Sets
// `both_ways` if the directions of the block's rays differ or one is uncertain. d/dt of U / W,
// times W^2, is linear over the rays, so the corners decide.
bool moves_back(const MapFromView& map, const PixelRect& rays, const LastRay& last, int axis,
                bool& both_ways) {
  int back = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const ImageLine l = image_line(map, rays.u0_px + (corner & 1 ? last.right : 0),
                                   rays.v0_px + (corner & 2 ? last.down : 0));
    const double a = (axis ? l.v_slope : l.u_slope) * l.w_offset,
                 b = (axis ? l.v_offset : l.u_offset) * l.w_slope;
    if (!(std::abs(a - b) > kUncertainDirection * (std::abs(a) + std::abs(b)))) both_ways = true;
    back += a < b;
  }
  if (back != 0 && back != 4) both_ways = true;
  return back == 4;
}

// Sets the origin to the pixel of the block's central ray at the block's begin, clamped to the
// stored region.
void set_origin(BlockCamera& c, const Block& block, const LastRay& last, const PixelRect& stored) {
  const Eigen::Vector3d center =
      c.exact->at_eye + block.begin * c.exact->at_infinity *
                            Eigen::Vector3d(block.rays.u0_px + 0.5 * last.right,
                                            block.rays.v0_px + 0.5 * last.down, 1);
  const auto origin = [](double at, int low, int high) {
    return !(at > low) ? low : at >= high ? high : int(at);
  };
  c.origin_u_px = origin(center.x() / center.z(), stored.u0_px, stored.u1_px - 1);
  c.origin_v_px = origin(center.y() / center.z(), stored.v0_px, stored.v1_px - 1);
}

// Sets the directions of the images and the quadrant ahead. Returns false if a quadrant is missing
// or too large.
bool set_direction(BlockCamera& c, const PixelRect& rays, const LastRay& last,
                   const SkipMap& skip_map) {
  c.both_ways = false;
  const bool left = moves_back(*c.exact, rays, last, 0, c.both_ways),
             up = moves_back(*c.exact, rays, last, 1, c.both_ways);
  for (const Quadrant box :
       {Quadrant::right_down, Quadrant::left_down, Quadrant::right_up, Quadrant::left_up})
    if ((c.both_ways || box == quadrant_ahead(left, up)) && !skip_map.has(box)) return false;
  if (skip_map.box_bytes() > kMaxBoxBytes) return false;
  c.box_bytes = std::int32_t(skip_map.box_bytes());
  c.sign_u = left && !c.both_ways ? -1 : 1;
  c.sign_v = up && !c.both_ways ? -1 : 1;
  const PixelRect& stored = skip_map.stored();
  c.at_origin = skip_map.bytes(c.both_ways ? Quadrant::right_down : quadrant_ahead(left, up)) +
                std::ptrdiff_t(c.origin_v_px - (c.sign_v < 0) - stored.v0_px) * skip_map.stride() +
                (c.origin_u_px - (c.sign_u < 0) - stored.u0_px);
  return true;
}

// Sets the range of the stored pixels and the distances between them, along the mirrored axes.
void set_store(BlockCamera& c, const SkipMap& skip_map) {
  const auto ends = [](int low, int high, int origin_px, int sign) {
    return sign > 0 ? std::array{float(low - origin_px), float(high - 1 - origin_px)}
                    : std::array{float(origin_px - high), float(origin_px - 1 - low)};
  };
  const PixelRect& stored = skip_map.stored();
  const auto ends_u = ends(stored.u0_px, stored.u1_px, c.origin_u_px, c.sign_u),
             ends_v = ends(stored.v0_px, stored.v1_px, c.origin_v_px, c.sign_v);
  c.min_u = ends_u[0], c.max_u = ends_u[1], c.min_v = ends_v[0], c.max_v = ends_v[1];
  c.step_u = float(c.sign_u), c.step_v = float(c.sign_v * skip_map.stride());
}

// (U, V, W) of the block's rays, relative to the origin, along the mirrored axes and to pixel
// centres.
struct Projection {
  Eigen::Matrix3d turn;             // slope per view column, per view row, and constant
  Eigen::Vector3d slope, at_begin;  // of the first ray
};
Projection projection(const BlockCamera& c, const Block& block) {
  Projection p;
  p.turn = c.exact->at_infinity;
  Eigen::Vector3d eye = c.exact->at_eye;
  p.turn.row(0) -= c.origin_u_px * p.turn.row(2);
  p.turn.row(1) -= c.origin_v_px * p.turn.row(2);
  eye.head<2>() -= Eigen::Vector2d(c.origin_u_px, c.origin_v_px) * eye.z();
  p.turn.row(0) = c.sign_u * p.turn.row(0) - 0.5 * p.turn.row(2),
  p.turn.row(1) = c.sign_v * p.turn.row(1) - 0.5 * p.turn.row(2);
  eye.head<2>() = Eigen::Vector2d(c.sign_u * eye.x(), c.sign_v * eye.y()) -
                  Eigen::Vector2d::Constant(0.5 * eye.z());
  p.slope = p.turn * Eigen::Vector3d(block.rays.u0_px, block.rays.v0_px, 1);
  p.at_begin = eye + block.begin * p.slope;
  return p;
}

// Sets the error bounds of positions (kFormError, kQuotientError). Returns false if they exceed
// kMaxEps_px, or if W is not positive or varies too much.
bool set_error_bounds(BlockCamera& c, const Projection& p, double begin, double span,
                      const LastRay& last) {
  double min_w = kNever, max_begin = 0, max_slope = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector3d of_corner = (corner & 1 ? last.right : 0) * p.turn.col(0) +
                                      (corner & 2 ? last.down : 0) * p.turn.col(1);
    const Eigen::Vector3d corner_slope = p.slope + of_corner,
                          corner_begin = p.at_begin + begin * of_corner;
    min_w = std::min({min_w, corner_begin.z(), corner_begin.z() + span * corner_slope.z()});
    max_begin = std::max({max_begin, std::abs(corner_begin.x()), std::abs(corner_begin.y())});
    max_slope = std::max({max_slope, std::abs(corner_slope.x()), std::abs(corner_slope.y())});
  }
  // Sums of the absolute values of the terms, because the terms themselves may cancel.
  const Eigen::Array3d steps =
      last.right * p.turn.col(0).array().abs() + last.down * p.turn.col(1).array().abs();
  const Eigen::Array3d terms_begin = p.at_begin.array().abs() + begin * steps,
                       terms_slope = p.slope.array().abs() + steps;
  const double terms_w = terms_begin.z() + span * terms_slope.z();
  if (!(min_w > 0 && terms_w <= kMaxDepthRatio * min_w)) return false;
  const double of_position = kFormError * terms_w / min_w + kQuotientError;
  c.eps_px =
      float(kHalfUlp / min_w *
            (kFormError * std::max(terms_begin.x(), terms_begin.y()) + of_position * max_begin));
  c.eps_px_per_m =
      float(kHalfUlp / min_w *
            (kFormError * std::max(terms_slope.x(), terms_slope.y()) + of_position * max_slope));
  return c.eps_px + span * c.eps_px_per_m < kMaxEps_px;
}

void set_forms(BlockCamera& c, const Projection& p, double begin) {
  for (int k = 0; k < 3; ++k) {
    c.at_begin[k] = float(p.at_begin[k]);
    c.slope[k] = float(p.slope[k]);
    c.du[k] = float(p.turn(k, 0));
    c.dv[k] = float(p.turn(k, 1));
    c.du_begin[k] = float(begin * p.turn(k, 0));
    c.dv_begin[k] = float(begin * p.turn(k, 1));
  }
}

}  // namespace

bool prepare(Block& block, std::span<const MapFromView> maps,
             std::span<const SkipMap* const> skip_maps) {
  const LastRay last = last_ray(block.rays);
  block.cameras.resize(maps.size());
  for (std::size_t n = 0; n < maps.size(); ++n) {
    BlockCamera& c = block.cameras[n];
    c.exact = &maps[n];
    set_origin(c, block, last, skip_maps[n]->stored());
    if (!set_direction(c, block.rays, last, *skip_maps[n])) return false;
    const Projection p = projection(c, block);
    if (!set_error_bounds(c, p, block.begin, block.end - block.begin, last)) return false;
    set_forms(c, p, block.begin);
    set_store(c, *skip_maps[n]);
  }
  return true;
}

}  // namespace fivepipe::hull
