// The plane sweep with SIMD. First the lanes hold planes of a tile, which are tested by counts;
// then they hold rays on a plane.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "benchmarks/hull/baselines/cpu_plane_sweep_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "benchmarks/hull/baselines/cpu_plane_sweep.h"
#include "benchmarks/hull/baselines/object_pixel_lookup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::baselines::HWY_NAMESPACE {

// Bit k is the plane of lane k.
struct PlaneSet {
  std::uint32_t possible;                // planes that may have hull
  std::uint32_t full[kMaxSweptCameras];  // per camera: planes on which its image is full
};

HWY_INLINE std::uint32_t bits_of(M mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0] | std::uint32_t(bytes[1]) << 8;
}

HWY_INLINE Contents contents_on_planes(const SweptCamera& c, const hull::PixelRect& rays, V t) {
  V x0 = hn::Set(d, 1e30f), y0 = x0, x1 = hn::Neg(x0), y1 = x1, min_w = x0;
  for (const int u : {rays.u0_px, rays.u1_px - 1})
    for (const int v : {rays.v0_px, rays.v1_px - 1}) {
      const auto coordinate = [&](std::size_t k) HWY_ATTR {
        return hn::MulAdd(t, hn::Set(d, c.of_u[k] * float(u) + c.of_v[k] * float(v) + c.of_1[k]),
                          hn::Set(d, c.at_eye[k]));
      };
      const V w = coordinate(2), scale = reciprocal(w), x = hn::Mul(coordinate(0), scale),
              y = hn::Mul(coordinate(1), scale);
      x0 = hn::Min(x0, x);
      y0 = hn::Min(y0, y);
      x1 = hn::Max(x1, x);
      y1 = hn::Max(y1, y);
      min_w = hn::Min(min_w, w);
    }
  const V slack = hn::Set(d, kRounding_px);
  const Contents contents = contents_of(c.map, hn::Sub(x0, slack), hn::Sub(y0, slack),
                                        hn::Add(x1, slack), hn::Add(y1, slack));
  const M in_front = hn::Gt(min_w, hn::Zero(d));
  return {hn::And(contents.none, in_front), hn::And(contents.all, in_front)};
}

HWY_INLINE void planes_of(std::span<const SweptCamera> cameras, const hull::PixelRect& rays, V t,
                          std::uint32_t candidates, PlaneSet& planes) {
  planes.possible = candidates;
  for (std::size_t i = 0; i < cameras.size() && planes.possible; ++i) {
    const Contents contents = contents_on_planes(cameras[i], rays, t);
    planes.possible &= ~bits_of(contents.none);
    planes.full[i] = bits_of(contents.all);
  }
}

// A camera's homography on one plane.
struct Homography {
  const LookupTables* map;
  float of_u[3], of_v[3], of_1[3];
};

// Returns which of the rays (u, v) hit object pixels of every camera in `homographies`.
HWY_INLINE M hit(std::span<const Homography> homographies, V u, V v, M alive) {
  for (const Homography& h : homographies) {
    const auto coordinate = [&](std::size_t k) HWY_ATTR {
      return hn::MulAdd(hn::Set(d, h.of_u[k]), u,
                        hn::MulAdd(hn::Set(d, h.of_v[k]), v, hn::Set(d, h.of_1[k])));
    };
    const V w = coordinate(2), scale = reciprocal(w);
    const M on = on_object(*h.map, hn::Mul(coordinate(0), scale), hn::Mul(coordinate(1), scale));
    alive = hn::And(alive, hn::And(on, hn::Gt(w, hn::Zero(d))));
    if (hn::AllFalse(d, alive)) break;
  }
  return alive;
}

// A tile's rays. Each vector holds a block of kWide x kHigh.
class Rays {
 public:
  explicit Rays(const SweptTile& tile) : tile_(tile) {
    for (int v = 0; v < tile.rays.height_px(); v += kHigh)
      for (int u = 0; u < tile.rays.width_px(); u += kWide, ++left_) {
        const VI i = hn::Iota(di, 0);
        u_[left_] = hn::ConvertTo(
            d, hn::Add(hn::And(i, hn::Set(di, kWide - 1)), hn::Set(di, tile.rays.u0_px + u)));
        v_[left_] = hn::ConvertTo(
            d, hn::Add(hn::ShiftRight<kWideBits>(i), hn::Set(di, tile.rays.v0_px + v)));
        order_[left_] = left_;
        undecided_[left_] = hn::And(hn::Lt(u_[left_], hn::Set(d, float(tile.rays.u1_px))),
                                    hn::Lt(v_[left_], hn::Set(d, float(tile.rays.v1_px))));
        depths_[left_] = hn::Set(d, hull::kNoHull);
      }
  }
  bool done() const { return left_ == 0; }

  HWY_INLINE void sweep(std::span<const Homography> homographies, float depth_m) {
    for (int n = 0; n < left_;) {
      const int i = order_[n];
      const M hits = hit(homographies, u_[i], v_[i], undecided_[i]);
      depths_[i] = hn::IfThenElse(hits, hn::Set(d, depth_m), depths_[i]);
      undecided_[i] = hn::AndNot(hits, undecided_[i]);
      if (hn::AllFalse(d, undecided_[i]))
        order_[n] = order_[--left_];
      else
        ++n;
    }
  }

  void store() const {
    HWY_ALIGN float block[16];
    const int width = tile_.rays.width_px(), height = tile_.rays.height_px();
    for (int v = 0, i = 0; v < height; v += kHigh)
      for (int u = 0; u < width; u += kWide, ++i) {
        hn::Store(depths_[i], d, block);
        for (int y = 0; y < kHigh && v + y < height; ++y)
          std::copy_n(block + y * kWide, std::min(kWide, width - u),
                      tile_.depth_m + std::size_t(v + y) * tile_.stride + u);
      }
  }

 private:
  static constexpr int kLanes = int(hn::MaxLanes(D())),
                       kWideBits = kLanes >= 8   ? 3
                                   : kLanes >= 4 ? 2
                                                 : 0,
                       kWide = 1 << kWideBits, kHigh = kLanes / kWide;

  const SweptTile& tile_;
  int left_ = 0;
  static constexpr int kMaxVectors =
      (kSweptTile_px + kWide - 1) / kWide * ((kSweptTile_px + kHigh - 1) / kHigh);
  int order_[kMaxVectors];  // the first left_ entries: vectors with undecided rays
  V u_[kMaxVectors], v_[kMaxVectors], depths_[kMaxVectors];
  M undecided_[kMaxVectors];
};

void sweep_tile(std::span<const SweptCamera> cameras, const SweptTile& tile) {
  const int lanes = int(hn::Lanes(d));
  Rays rays(tile);
  PlaneSet planes;
  Homography homographies[kMaxSweptCameras];
  for (int first = tile.first_plane; first < tile.end_plane && !rays.done(); first += lanes) {
    const V t =
        hn::MulAdd(hn::Iota(d, float(first)), hn::Set(d, tile.step_m), hn::Set(d, tile.near_m));
    const int left = std::min(lanes, tile.end_plane - first);
    const std::uint32_t all = (1u << left) - 1;
    if (tile.swept == SweptPlanes::by_counts)
      planes_of(cameras, tile.rays, t, all, planes);
    else
      planes.possible = all, std::fill_n(planes.full, cameras.size(), 0);
    for (std::uint32_t set = planes.possible; set && !rays.done(); set &= set - 1) {
      const int k = hwy::Num0BitsBelowLS1Bit_Nonzero32(set);
      const float depth_m = tile.near_m + float(first + k) * tile.step_m;
      std::size_t mixed = 0;
      for (std::size_t i = 0; i < cameras.size(); ++i) {
        if (planes.full[i] >> k & 1) continue;
        const SweptCamera& c = cameras[i];
        Homography& h = homographies[mixed++];
        h.map = &c.map;
        for (std::size_t j = 0; j < 3; ++j) {
          h.of_u[j] = depth_m * c.of_u[j];
          h.of_v[j] = depth_m * c.of_v[j];
          h.of_1[j] = depth_m * c.of_1[j] + c.at_eye[j];
        }
      }
      rays.sweep({homographies, mixed}, first + k == 0 ? depth_m : depth_m - tile.before_m);
    }
  }
  rays.store();
}

}  // namespace fivepipe::baselines::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::baselines {
HWY_EXPORT(sweep_tile);
void sweep_tile(std::span<const SweptCamera> cameras, const SweptTile& tile) {
  HWY_DYNAMIC_DISPATCH(sweep_tile)(cameras, tile);
}
}  // namespace fivepipe::baselines
#endif
