#include <algorithm>
#include <array>
#include <cmath>

#include "common/hull/cpu/ray_simd.h"
#include "common/hull/cpu/ray_walk.h"

namespace fivepipe::hull {
namespace {

// Places in a map's bytes are found in float: exact up to here.
constexpr std::size_t kMaxBoxBytes = std::size_t{1} << 24;

// Roundings of float on the way to a position, each at most 2^-24 of what it is taken of. A form
// (U, V or W): its coefficients from double, two steps to the ray and one along it, of the sum of
// its terms' sizes. The quotient: the reciprocal, on its worst target, and the product, of the
// position.
constexpr double kFormError = 4, kQuotientError = 6, kHalfUlp = 0x1p-24;

// An image moves left along axis 0, or up along axis 1. `both_ways` is set where the rays of the
// block differ, or one nearly stands still: d/dt of U / W, times W^2, is linear over the rays, so
// that the corners tell.
bool moves_back(const MapFromView& map, const PixelRect& rays, int right, int down, int axis,
                bool& both_ways) {
  int back = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const ImageLine l = image_line(map, rays.u0_px + (corner & 1 ? right : 0),
                                   rays.v0_px + (corner & 2 ? down : 0));
    const double a = (axis ? l.v_slope : l.u_slope) * l.w_offset,
                 b = (axis ? l.v_offset : l.u_offset) * l.w_slope;
    if (!(std::abs(a - b) > kUncertainDirection * (std::abs(a) + std::abs(b)))) both_ways = true;
    back += a < b;
  }
  if (back != 0 && back != 4) both_ways = true;
  return back == 4;
}

}  // namespace

bool prepare(Block& block, std::span<const MapFromView> maps,
             std::span<const SkipMap* const> skip_maps) {
  const double begin = block.begin, span = block.end - block.begin;
  // Whole tiles: the rays at their corners stand for all.
  const auto last = [](int size) { return (size + kTile_px - 1) / kTile_px * kTile_px - 1; };
  const int right = last(block.rays.width_px()), down = last(block.rays.height_px());
  block.cameras.resize(maps.size());
  for (std::size_t n = 0; n < maps.size(); ++n) {
    const MapFromView& map = maps[n];
    const PixelRect& stored = skip_maps[n]->stored();
    BlockCamera& c = block.cameras[n];
    c.exact = &map;
    Eigen::Matrix3d turn = map.at_infinity;
    Eigen::Vector3d eye = map.at_eye;
    // Pixels count from where the block's middle ray begins, if that is in store.
    const Eigen::Vector3d middle =
        eye + begin * turn *
                  Eigen::Vector3d(block.rays.u0_px + 0.5 * right, block.rays.v0_px + 0.5 * down, 1);
    const auto origin = [](double at, int least, int most) {
      return !(at > least) ? least : at >= most ? most : int(at);
    };
    c.origin_u_px = origin(middle.x() / middle.z(), stored.u0_px, stored.u1_px - 1);
    c.origin_v_px = origin(middle.y() / middle.z(), stored.v0_px, stored.v1_px - 1);
    turn.row(0) -= c.origin_u_px * turn.row(2);
    turn.row(1) -= c.origin_v_px * turn.row(2);
    eye.head<2>() -= Eigen::Vector2d(c.origin_u_px, c.origin_v_px) * eye.z();
    c.both_ways = false;
    const bool left = moves_back(map, block.rays, right, down, 0, c.both_ways),
               up = moves_back(map, block.rays, right, down, 1, c.both_ways);
    for (const Quadrant box :
         {Quadrant::right_down, Quadrant::left_down, Quadrant::right_up, Quadrant::left_up})
      if ((c.both_ways || box == quadrant_ahead(left, up)) && !skip_maps[n]->has(box)) return false;
    if (skip_maps[n]->box_bytes() > kMaxBoxBytes) return false;
    c.sign_u = left && !c.both_ways ? -1 : 1;
    c.sign_v = up && !c.both_ways ? -1 : 1;
    // Mirrored where all move back; then to pixels' centres.
    turn.row(0) = c.sign_u * turn.row(0) - 0.5 * turn.row(2),
    turn.row(1) = c.sign_v * turn.row(1) - 0.5 * turn.row(2);
    eye.head<2>() = Eigen::Vector2d(c.sign_u * eye.x(), c.sign_v * eye.y()) -
                    Eigen::Vector2d::Constant(0.5 * eye.z());
    const Eigen::Vector3d slope = turn * Eigen::Vector3d(block.rays.u0_px, block.rays.v0_px, 1),
                          at_begin = eye + begin * slope;
    double min_w = kNever, max_begin = 0, max_slope = 0;
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector3d of_corner =
          (corner & 1 ? right : 0) * turn.col(0) + (corner & 2 ? down : 0) * turn.col(1);
      const Eigen::Vector3d corner_slope = slope + of_corner,
                            corner_begin = at_begin + begin * of_corner;
      min_w = std::min({min_w, corner_begin.z(), corner_begin.z() + span * corner_slope.z()});
      max_begin = std::max({max_begin, std::abs(corner_begin.x()), std::abs(corner_begin.y())});
      max_slope = std::max({max_slope, std::abs(corner_slope.x()), std::abs(corner_slope.y())});
    }
    // Sizes of the terms, which may cancel.
    const Eigen::Array3d steps =
        right * turn.col(0).array().abs() + down * turn.col(1).array().abs();
    const Eigen::Array3d terms_begin = at_begin.array().abs() + begin * steps,
                         terms_slope = slope.array().abs() + steps;
    const double terms_w = terms_begin.z() + span * terms_slope.z();
    if (!(min_w > 0 && terms_w <= kMaxDepthRatio * min_w)) return false;
    const double of_position = kFormError * terms_w / min_w + kQuotientError;
    c.box_bytes = std::int32_t(skip_maps[n]->box_bytes());
    c.eps_px =
        float(kHalfUlp / min_w *
              (kFormError * std::max(terms_begin.x(), terms_begin.y()) + of_position * max_begin));
    c.eps_px_per_m =
        float(kHalfUlp / min_w *
              (kFormError * std::max(terms_slope.x(), terms_slope.y()) + of_position * max_slope));
    if (!(c.eps_px + span * c.eps_px_per_m < kMaxEps_px)) return false;
    for (int k = 0; k < 3; ++k) {
      c.at_begin[k] = float(at_begin[k]);
      c.slope[k] = float(slope[k]);
      c.du[k] = float(turn(k, 0));
      c.dv[k] = float(turn(k, 1));
      c.du_begin[k] = float(begin * turn(k, 0));
      c.dv_begin[k] = float(begin * turn(k, 1));
    }
    const auto ends = [](int low, int high, int origin_px, int sign) {
      return sign > 0 ? std::array{float(low - origin_px), float(high - 1 - origin_px)}
                      : std::array{float(origin_px - high), float(origin_px - 1 - low)};
    };
    const auto ends_u = ends(stored.u0_px, stored.u1_px, c.origin_u_px, c.sign_u),
               ends_v = ends(stored.v0_px, stored.v1_px, c.origin_v_px, c.sign_v);
    c.min_u = ends_u[0], c.max_u = ends_u[1], c.min_v = ends_v[0], c.max_v = ends_v[1];
    c.step_u = float(c.sign_u), c.step_v = float(c.sign_v * skip_maps[n]->stride());
    c.at_origin =
        skip_maps[n]->bytes(c.both_ways ? Quadrant::right_down : quadrant_ahead(left, up)) +
        std::ptrdiff_t(c.origin_v_px - (c.sign_v < 0) - stored.v0_px) * skip_maps[n]->stride() +
        (c.origin_u_px - (c.sign_u < 0) - stored.u0_px);
  }
  return true;
}

}  // namespace fivepipe::hull
