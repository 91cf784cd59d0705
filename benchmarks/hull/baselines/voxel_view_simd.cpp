// Ray casting of the voxels; the SIMD lanes hold a block of neighbouring rays.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "benchmarks/hull/baselines/voxel_view_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "benchmarks/hull/baselines/object_pixel_lookup-inl.h"
#include "benchmarks/hull/baselines/voxel_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::baselines::HWY_NAMESPACE {

using MI = hn::Mask<DI>;

// The slope of a ray along an axis, in voxels per metre of depth, is clamped to at least this. Such
// a ray moves by 1e-5 voxels in a scene of 10 m, and the slope's reciprocal is finite.
constexpr float kSlowest = 1e-6f;

struct Axis {
  V eye, slope, per_slope;
  M ascends;
};
HWY_INLINE Axis axis_of(const DrawnView& view, std::size_t k, V u, V v) {
  const V eye = hn::Set(d, view.eye[k]), slowest = hn::Set(d, kSlowest);
  V slope = hn::MulAdd(hn::Set(d, view.of_u[k]), u,
                       hn::MulAdd(hn::Set(d, view.of_v[k]), v, hn::Set(d, view.of_1[k])));
  slope = hn::IfThenElse(hn::Lt(hn::Abs(slope), slowest), slowest, slope);
  return {eye, slope, hn::Div(hn::Set(d, 1.0f), slope), hn::Gt(slope, hn::Zero(d))};
}

// The depths at which the ray enters and leaves [low, high] of an axis.
HWY_INLINE V entry(const Axis& a, V low, V high) {
  return hn::Mul(hn::Sub(hn::IfThenElse(a.ascends, low, high), a.eye), a.per_slope);
}
HWY_INLINE V exit(const Axis& a, V low, V high) {
  return hn::Mul(hn::Sub(hn::IfThenElse(a.ascends, high, low), a.eye), a.per_slope);
}

HWY_INLINE VI voxel_at(const Axis& a, V t, VI low,
                       VI high) {  // clamped to [low, high]; both are >= 0, so truncation is floor
  return hn::Min(hn::Max(hn::ConvertTo(di, hn::MulAdd(t, a.slope, a.eye)), low), high);
}

// Whether a voxel is occupied, and the edges of the empty block around it.
struct Found {
  M occupied;
  VI edge_xy, edge_z;
};
HWY_INLINE Found voxel_at(const VoxelGrid& grid, VI x, VI y, VI z) {
  const auto bit = [](VI i, VI which) HWY_ATTR { return hn::And(i, which); };
  const VI one = hn::Set(di, 1), two = hn::Set(di, 2), four = hn::Set(di, 4),
           eight = hn::Set(di, 8), zero = hn::Zero(di);
  const VI bricks_yx =
      hn::Or(hn::ShiftLeftSame(hn::ShiftRight<3>(y), grid.y_shift), hn::ShiftRight<3>(x));
  const VI brick =
      hn::GatherIndex(di, grid.index.data(),
                      hn::Or(hn::ShiftLeftSame(hn::ShiftRight<3>(z), grid.z_shift), bricks_yx));
  const MI has_voxels = hn::Gt(brick, hn::Set(di, -1));
  // The blocks of four are in the order x, y, z and have two words each, in the order of z.
  const VI fours =
      hn::Or(hn::ShiftRight<1>(bit(x, four)), hn::Or(bit(y, four), hn::ShiftLeft<1>(bit(z, four))));
  const VI word_at = hn::Or(fours, hn::ShiftRight<1>(bit(z, two)));
  const VI at = hn::Add(hn::ShiftLeft<4>(hn::Max(brick, zero)), word_at);
  const VI word = hn::IfThenElseZero(
      has_voxels,
      hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(grid.voxels.data()), at));
  const VI shift = hn::Or(hn::ShiftLeft<2>(bit(x, two)), hn::ShiftLeft<3>(bit(y, two)));
  const VI byte = hn::And(hn::Shr(word, shift), hn::Set(di, 0xff));
  const VI in_byte =
      hn::Or(bit(x, one), hn::Or(hn::ShiftLeft<1>(bit(y, one)), hn::ShiftLeft<2>(bit(z, one))));
  const MI occupied =
      hn::Or(hn::TestBit(byte, hn::Shl(one, in_byte)), hn::Eq(brick, hn::Set(di, kFullBrick)));
  const MI empty_byte = hn::Eq(byte, zero), empty_word = hn::Eq(word, zero);
  const VI small = hn::IfThenElse(empty_byte, two, one);
  return {as_float_mask(occupied),
          hn::IfThenElse(has_voxels, hn::IfThenElse(empty_word, four, small), eight),
          hn::IfThenElse(has_voxels, small, eight)};
}

// Moves a coordinate to the point at depth t where the ray leaves the block [low, low + edge):
// across the border if the ray leaves along this axis.
HWY_INLINE VI moved(const Axis& a, VI low, VI edge, V own_exit, V t) {
  const VI one = hn::Set(di, 1), high = hn::Add(low, edge);
  const VI over = hn::IfThenElse(hn::RebindMask(di, a.ascends), high, hn::Sub(low, one));
  return hn::IfThenElse(hn::RebindMask(di, hn::Le(own_exit, t)), over,
                        voxel_at(a, t, low, hn::Sub(high, one)));
}

// The state of a block of rays.
struct Walk {
  Axis ax, ay, az;
  V near, end;
  VI x, y, z;  // the current voxel
  M alive, hits;
};

HWY_INLINE Walk started(const DrawnView& view, const DrawnTile& tile, V u, V v, M alive) {
  Walk w{axis_of(view, 0, u, v),
         axis_of(view, 1, u, v),
         axis_of(view, 2, u, v),
         hn::Set(d, view.near_m),
         {},
         {},
         {},
         {},
         alive,
         hn::Lt(u, u)};
  V t = hn::Set(d, std::max(view.near_m, tile.begin_m));
  w.end = hn::Set(d, std::min(view.far_m, tile.end_m));
  const Axis* axes[3] = {&w.ax, &w.ay, &w.az};
  for (std::size_t k = 0; k < 3; ++k) {
    const V low = hn::Set(d, float(view.begin_voxel[k])),
            high = hn::Set(d, float(view.end_voxel[k]));
    t = hn::Max(t, entry(*axes[k], low, high));
    w.end = hn::Min(w.end, exit(*axes[k], low, high));
  }
  const auto at = [&](std::size_t k) HWY_ATTR {
    return voxel_at(*axes[k], t, hn::Set(di, view.begin_voxel[k]),
                    hn::Set(di, view.end_voxel[k] - 1));
  };
  w.x = at(0);
  w.y = at(1);
  w.z = at(2);
  w.alive = hn::And(alive, hn::Lt(t, w.end));
  return w;
}

// Tests the current voxel and advances. Returns false if no ray is left.
HWY_INLINE bool step(const VoxelGrid& grid, const DrawnView& view, Walk& w) {
  const Found found = voxel_at(grid, w.x, w.y, w.z);
  w.hits = hn::Or(w.hits, hn::And(w.alive, found.occupied));
  w.alive = hn::AndNot(found.occupied, w.alive);
  const VI x0 = hn::And(w.x, hn::Neg(found.edge_xy)), y0 = hn::And(w.y, hn::Neg(found.edge_xy)),
           z0 = hn::And(w.z, hn::Neg(found.edge_z));
  const auto leave = [](const Axis& a, VI from, VI edge) HWY_ATTR {
    return exit(a, hn::ConvertTo(d, from), hn::ConvertTo(d, hn::Add(from, edge)));
  };
  const V tx = leave(w.ax, x0, found.edge_xy), ty = leave(w.ay, y0, found.edge_xy),
          tz = leave(w.az, z0, found.edge_z);
  const V t = hn::Min(tx, hn::Min(ty, tz));
  const VI x = moved(w.ax, x0, found.edge_xy, tx, t), y = moved(w.ay, y0, found.edge_xy, ty, t),
           z = moved(w.az, z0, found.edge_z, tz, t);
  const auto within = [&](VI i, std::size_t k) HWY_ATTR {
    return hn::Eq(
        hn::Min(hn::Max(i, hn::Set(di, view.begin_voxel[k])), hn::Set(di, view.end_voxel[k] - 1)),
        i);
  };
  w.alive = hn::And(
      w.alive, hn::And(hn::Lt(t, w.end),
                       as_float_mask(hn::And(within(x, 0), hn::And(within(y, 1), within(z, 2))))));
  const MI going = hn::RebindMask(di, w.alive);
  w.x = hn::IfThenElse(going, x, w.x);
  w.y = hn::IfThenElse(going, y, w.y);
  w.z = hn::IfThenElse(going, z, w.z);
  return !hn::AllFalse(d, w.alive);
}

// The depth at which the rays that hit enter their voxel.
HWY_INLINE V depth_of(const Walk& w) {
  const auto into = [](const Axis& a, VI i) HWY_ATTR {
    return entry(a, hn::ConvertTo(d, i), hn::ConvertTo(d, hn::Add(i, hn::Set(di, 1))));
  };
  const V depth =
      hn::Max(hn::Max(w.near, into(w.ax, w.x)), hn::Max(into(w.ay, w.y), into(w.az, w.z)));
  return hn::IfThenElse(w.hits, depth, hn::Set(d, hull::kNoHull));
}

// A tile's rays in blocks of width kWide. kAtOnce blocks advance alternately, because a step is a
// chain of two gathers and some sixty operations that depend on each other.
class TileRays {
 public:
  explicit TileRays(const DrawnTile& tile)
      : tile_(tile), across_((tile.rays.width_px() + wide_ - 1) / wide_) {}
  int blocks() const { return across_ * ((tile_.rays.height_px() + high_ - 1) / high_); }

  HWY_INLINE Walk start(const DrawnView& view, int block) const {
    const VI i = hn::Iota(di, 0);
    const VI u = hn::Add(hn::And(i, hn::Set(di, wide_ - 1)),
                         hn::Set(di, tile_.rays.u0_px + block % across_ * wide_));
    const VI v = hn::Add(wide_ == 4 ? hn::ShiftRight<2>(i) : hn::Zero(di),
                         hn::Set(di, tile_.rays.v0_px + block / across_ * high_));
    const MI in_tile =
        hn::And(hn::Lt(u, hn::Set(di, block < blocks() ? tile_.rays.u1_px : tile_.rays.u0_px)),
                hn::Lt(v, hn::Set(di, tile_.rays.v1_px)));
    return started(view, tile_, hn::ConvertTo(d, u), hn::ConvertTo(d, v), as_float_mask(in_tile));
  }

  HWY_INLINE void store(int block, V depth) const {
    HWY_ALIGN float depths[16];
    hn::Store(depth, d, depths);
    const int u = block % across_ * wide_, v = block / across_ * high_;
    for (int y = 0; y < high_ && v + y < tile_.rays.height_px(); ++y)
      std::copy_n(depths + y * wide_, std::min(wide_, tile_.rays.width_px() - u),
                  tile_.depth_m + std::size_t(v + y) * tile_.stride + u);
  }

 private:
  const DrawnTile& tile_;
  const int lanes_ = int(hn::Lanes(d)), wide_ = std::min(4, lanes_), high_ = lanes_ / wide_,
            across_;
};

void draw_tile(const VoxelGrid& grid, const DrawnView& view, const DrawnTile& tile) {
  constexpr int kAtOnce = 2;
  const TileRays rays(tile);
  for (int first = 0; first < rays.blocks(); first += kAtOnce) {
    Walk a = rays.start(view, first), b = rays.start(view, first + 1);
    for (bool more = true; more;) {
      const bool more_a = step(grid, view, a);
      more = step(grid, view, b) || more_a;
    }
    rays.store(first, depth_of(a));
    if (first + 1 < rays.blocks()) rays.store(first + 1, depth_of(b));
  }
}

}  // namespace fivepipe::baselines::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::baselines {
HWY_EXPORT(draw_tile);
void draw_tile(const VoxelGrid& grid, const DrawnView& view, const DrawnTile& tile) {
  HWY_DYNAMIC_DISPATCH(draw_tile)(grid, view, tile);
}
}  // namespace fivepipe::baselines
#endif
