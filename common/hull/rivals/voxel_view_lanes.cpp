// Rays through the voxels, a block of neighbouring rays in vector lanes.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/rivals/voxel_view_lanes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "common/hull/rivals/object_pixel_lookup-inl.h"
#include "common/hull/rivals/voxel_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::rivals::HWY_NAMESPACE {

using MI = hn::Mask<DI>;

// Rays slower than this along an axis [voxels per metre of depth] are taken to be this fast: in a scene of 10 m they do not leave
// their voxel for it, and its reciprocal is finite.
constexpr float kSlowest = 1e-6f;

struct Axis {
  V eye, slope, per_slope;
  M ascends;
};
HWY_INLINE Axis axis_of(const DrawnView& view, std::size_t k, V u, V v) {
  const V eye = hn::Set(d, view.eye[k]), slowest = hn::Set(d, kSlowest);
  V slope = hn::MulAdd(hn::Set(d, view.of_u[k]), u, hn::MulAdd(hn::Set(d, view.of_v[k]), v, hn::Set(d, view.of_1[k])));
  slope = hn::IfThenElse(hn::Lt(hn::Abs(slope), slowest), slowest, slope);
  return {eye, slope, hn::Div(hn::Set(d, 1.0f), slope), hn::Gt(slope, hn::Zero(d))};
}

// Depths at which the ray enters and leaves [low, high] of an axis.
HWY_INLINE V entry(const Axis& a, V low, V high) { return hn::Mul(hn::Sub(hn::IfThenElse(a.ascends, low, high), a.eye), a.per_slope); }
HWY_INLINE V exit(const Axis& a, V low, V high) { return hn::Mul(hn::Sub(hn::IfThenElse(a.ascends, high, low), a.eye), a.per_slope); }

HWY_INLINE VI voxel_at(const Axis& a, V t, VI low, VI high) {  // within [low, high]; both are not negative: truncation is floor
  return hn::Min(hn::Max(hn::ConvertTo(di, hn::MulAdd(t, a.slope, a.eye)), low), high);
}

// What is at a voxel: whether it is occupied, and the edges of an empty block around it.
struct Found {
  M occupied;
  VI edge_xy, edge_z;
};
HWY_INLINE Found look(const VoxelGrid& grid, VI x, VI y, VI z) {
  const auto bit = [](VI i, VI which) HWY_ATTR { return hn::And(i, which); };
  const VI one = hn::Set(di, 1), two = hn::Set(di, 2), four = hn::Set(di, 4), eight = hn::Set(di, 8), zero = hn::Zero(di);
  const VI row = hn::Add(hn::Mul(hn::ShiftRight<3>(z), hn::Set(di, grid.bricks[1])), hn::ShiftRight<3>(y));
  const VI brick = hn::GatherIndex(di, grid.index.data(), hn::Add(hn::Mul(row, hn::Set(di, grid.bricks[0])), hn::ShiftRight<3>(x)));
  const MI has_voxels = hn::Gt(brick, hn::Set(di, -1));
  // Blocks of four in the order x, y, z, two words each, the words in the order of z.
  const VI fours = hn::Or(hn::ShiftRight<1>(bit(x, four)), hn::Or(bit(y, four), hn::ShiftLeft<1>(bit(z, four))));
  const VI word_at = hn::Or(fours, hn::ShiftRight<1>(bit(z, two)));
  const VI at = hn::Add(hn::ShiftLeft<4>(hn::Max(brick, zero)), word_at);
  const VI word = hn::IfThenElseZero(has_voxels, hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(grid.voxels.data()), at));
  const VI shift = hn::Or(hn::ShiftLeft<2>(bit(x, two)), hn::ShiftLeft<3>(bit(y, two)));
  const VI byte = hn::And(hn::Shr(word, shift), hn::Set(di, 0xff));
  const VI in_byte = hn::Or(bit(x, one), hn::Or(hn::ShiftLeft<1>(bit(y, one)), hn::ShiftLeft<2>(bit(z, one))));
  const MI occupied = hn::Or(hn::TestBit(byte, hn::Shl(one, in_byte)), hn::Eq(brick, hn::Set(di, kFullBrick)));
  const MI empty_byte = hn::Eq(byte, zero), empty_word = hn::Eq(word, zero);
  const VI small = hn::IfThenElse(empty_byte, two, one);
  return {as_float_mask(occupied), hn::IfThenElse(has_voxels, hn::IfThenElse(empty_word, four, small), eight), hn::IfThenElse(has_voxels, small, eight)};
}

// Moves a coordinate to where the ray leaves the block [low, low + edge) at depth t: over the border if it is this axis's.
HWY_INLINE VI moved(const Axis& a, VI low, VI edge, V own_exit, V t) {
  const VI one = hn::Set(di, 1), high = hn::Add(low, edge);
  const VI over = hn::IfThenElse(hn::RebindMask(di, a.ascends), high, hn::Sub(low, one));
  return hn::IfThenElse(hn::RebindMask(di, hn::Le(own_exit, t)), over, voxel_at(a, t, low, hn::Sub(high, one)));
}

HWY_INLINE V draw_block(const VoxelGrid& grid, const DrawnView& view, const DrawnTile& tile, V u, V v, M alive) {
  const Axis ax = axis_of(view, 0, u, v), ay = axis_of(view, 1, u, v), az = axis_of(view, 2, u, v);
  const V near = hn::Set(d, view.near_m);
  const auto set = [](float x) HWY_ATTR { return hn::Set(d, x); };
  const auto seti = [](float x) HWY_ATTR { return hn::Set(di, int(x)); };
  const auto &low = view.begin_voxel, &high = view.end_voxel;
  V t = hn::Max(hn::Max(set(std::max(view.near_m, tile.begin_m)), entry(ax, set(low[0]), set(high[0]))), hn::Max(entry(ay, set(low[1]), set(high[1])), entry(az, set(low[2]), set(high[2]))));
  const V end = hn::Min(hn::Min(set(std::min(view.far_m, tile.end_m)), exit(ax, set(low[0]), set(high[0]))), hn::Min(exit(ay, set(low[1]), set(high[1])), exit(az, set(low[2]), set(high[2]))));
  alive = hn::And(alive, hn::Lt(t, end));
  if (hn::AllFalse(d, alive)) return hn::Set(d, kNoHull);
  const VI least[3] = {seti(low[0]), seti(low[1]), seti(low[2])}, most[3] = {seti(high[0] - 1), seti(high[1] - 1), seti(high[2] - 1)};
  VI x = voxel_at(ax, t, least[0], most[0]), y = voxel_at(ay, t, least[1], most[1]), z = voxel_at(az, t, least[2], most[2]);
  M hits = hn::Lt(near, near);
  for (;;) {
    const Found found = look(grid, x, y, z);
    hits = hn::Or(hits, hn::And(alive, found.occupied));
    alive = hn::AndNot(found.occupied, alive);
    const VI x0 = hn::And(x, hn::Neg(found.edge_xy)), y0 = hn::And(y, hn::Neg(found.edge_xy)), z0 = hn::And(z, hn::Neg(found.edge_z));
    const auto leave = [](const Axis& a, VI from, VI edge) HWY_ATTR { return exit(a, hn::ConvertTo(d, from), hn::ConvertTo(d, hn::Add(from, edge))); };
    const V tx = leave(ax, x0, found.edge_xy), ty = leave(ay, y0, found.edge_xy), tz = leave(az, z0, found.edge_z);
    t = hn::Min(tx, hn::Min(ty, tz));
    const VI next_x = moved(ax, x0, found.edge_xy, tx, t), next_y = moved(ay, y0, found.edge_xy, ty, t), next_z = moved(az, z0, found.edge_z, tz, t);
    const auto within = [&](VI i, std::size_t k) HWY_ATTR { return hn::Eq(hn::Min(hn::Max(i, least[k]), most[k]), i); };
    alive = hn::And(alive, hn::And(hn::Lt(t, end), as_float_mask(hn::And(within(next_x, 0), hn::And(within(next_y, 1), within(next_z, 2))))));
    if (hn::AllFalse(d, alive)) break;
    const MI going = hn::RebindMask(di, alive);
    x = hn::IfThenElse(going, next_x, x);
    y = hn::IfThenElse(going, next_y, y);
    z = hn::IfThenElse(going, next_z, z);
  }
  const auto into = [](const Axis& a, VI i) HWY_ATTR { return entry(a, hn::ConvertTo(d, i), hn::ConvertTo(d, hn::Add(i, hn::Set(di, 1)))); };
  const V depth = hn::Max(hn::Max(near, into(ax, x)), hn::Max(into(ay, y), into(az, z)));
  return hn::IfThenElse(hits, depth, hn::Set(d, kNoHull));
}

void draw_tile(const VoxelGrid& grid, const DrawnView& view, const DrawnTile& tile) {
  constexpr int kWide = 4;
  const int lanes = int(hn::Lanes(d)), wide = std::min(kWide, lanes), high = lanes / wide;
  HWY_ALIGN float us[16], vs[16], depths[16];
  const PixelRect& rays = tile.rays;
  for (int v0 = rays.v0_px; v0 < rays.v1_px; v0 += high)
    for (int u0 = rays.u0_px; u0 < rays.u1_px; u0 += wide) {
      for (int i = 0; i < lanes; ++i) {
        us[i] = float(u0 + i % wide);
        vs[i] = float(v0 + i / wide);
      }
      const V u = hn::Load(d, us), v = hn::Load(d, vs);
      const M alive = hn::And(hn::Lt(u, hn::Set(d, float(rays.u1_px))), hn::Lt(v, hn::Set(d, float(rays.v1_px))));
      hn::Store(draw_block(grid, view, tile, u, v, alive), d, depths);
      for (int y = 0; y < high && v0 + y < rays.v1_px; ++y)
        std::copy_n(depths + y * wide, std::min(wide, rays.u1_px - u0), tile.depth_m + std::size_t(v0 + y - rays.v0_px) * tile.stride + (u0 - rays.u0_px));
    }
}

}  // namespace fivepipe::rivals::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::rivals {
HWY_EXPORT(draw_tile);
void draw_tile(const VoxelGrid& grid, const DrawnView& view, const DrawnTile& tile) { HWY_DYNAMIC_DISPATCH(draw_tile)(grid, view, tile); }
}  // namespace fivepipe::rivals
#endif
