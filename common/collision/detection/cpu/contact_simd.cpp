#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/collision/detection/cpu/contact_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/collision/detection/cpu/contact_simd.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::collision {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::Rebind<std::int32_t, DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MF = hn::Mask<DF>;

HWY_INLINE std::uint32_t bits_of(MF mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(DF(), mask, bytes);
  return std::uint32_t(bytes[0]) | std::uint32_t(bytes[1]) << 8;
}

// Relative error at most 5.3 * 2^-24: one Newton step on the processor's estimate, whose error is
// at most 1.5 * 2^-12, and three roundings.
HWY_INLINE VF reciprocal(VF x) {
  const DF d;
  VF estimate = hn::ApproximateReciprocal(x);
  for (int step = 0; step < (HWY_ARCH_X86 ? 1 : 2); ++step)
    estimate = hn::Mul(estimate, hn::NegMulAdd(x, estimate, hn::Set(d, 2.0f)));
  return estimate;
}

// The skip map at pixel (fu, fv), which is clamped to the stored pixels.
HWY_INLINE VF extent_at(const ContactMap& c, VF& fu, VF& fv) {
  const DF d;
  const DI di;
  fu = hn::Min(hn::Max(fu, hn::Set(d, c.min_u)), hn::Set(d, c.max_u));
  fv = hn::Min(hn::Max(fv, hn::Set(d, c.min_v)), hn::Set(d, c.max_v));
  const VI place =
      hn::Add(hn::Mul(hn::ConvertTo(di, fv), hn::Set(di, c.stride)), hn::ConvertTo(di, fu));
  const VI word = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(c.at_base), place);
  return hn::ConvertTo(d, hn::ShiftRight<24>(hn::ShiftLeft<24>(word)));
}

struct RectContents {
  MF free, solid;
};

// Classifies the rectangle of images from (low_u, low_v) to (high_u, high_v).
HWY_INLINE RectContents classify_rect(const ContactMap& c, VF low_u, VF high_u, VF low_v,
                                      VF high_v) {
  const DF d;
  const VF eps = hn::Set(d, c.eps_px), zero = hn::Zero(d);
  low_u = hn::Sub(low_u, eps), high_u = hn::Add(high_u, eps), low_v = hn::Sub(low_v, eps),
  high_v = hn::Add(high_v, eps);
  const MF beside =
      hn::Or(hn::Or(hn::Lt(high_u, hn::Set(d, c.begin_u)), hn::Gt(low_u, hn::Set(d, c.end_u))),
             hn::Or(hn::Lt(high_v, hn::Set(d, c.begin_v)), hn::Gt(low_v, hn::Set(d, c.end_v))));
  VF fu = hn::Floor(low_u), fv = hn::Floor(low_v);
  const VF last_u = hn::Floor(high_u), last_v = hn::Floor(high_v), extent = extent_at(c, fu, fv);
  const VF one = hn::Set(d, 1.0f), width = hn::Add(hn::Sub(last_u, fu), one),
           height = hn::Add(hn::Sub(last_v, fv), one);
  // Looks up one square that covers the rectangle, or two along its longer side.
  const VF longer = hn::Max(width, height),
           side = hn::Max(hn::Min(width, height), hn::Ceil(hn::Mul(hn::Set(d, 0.5f), longer)));
  MF alike = hn::Ge(hn::Abs(extent), side);
  const MF object = hn::Lt(extent, zero), two = hn::And(alike, hn::Lt(side, longer));
  if (!hn::AllFalse(d, two)) {
    VF next_u = hn::Add(fu, hn::IfThenElseZero(hn::Gt(width, height), hn::Sub(width, side)));
    VF next_v = hn::Add(fv, hn::IfThenElseZero(hn::Gt(height, width), hn::Sub(height, side)));
    const VF next = extent_at(c, next_u, next_v);
    alike =
        hn::And(alike, hn::Or(hn::Not(two), hn::And(hn::Ge(hn::Abs(next), side),
                                                    hn::Not(hn::Xor(object, hn::Lt(next, zero))))));
  }
  return {hn::Or(beside, hn::AndNot(object, alike)), hn::AndNot(beside, hn::And(object, alike))};
}

HWY_INLINE MF nothing() {
  const DF d;
  return hn::Lt(hn::Zero(d), hn::Zero(d));
}
HWY_INLINE MF everything() {
  const DF d;
  return hn::Eq(hn::Zero(d), hn::Zero(d));
}

// Relative enlargement of a box's extent in the image: covers the rounding of a reciprocal and of
// at most ten operations on it (2^-24 each).
constexpr float kExtentSlack = 1 + 0x1p-18f;

// Row `row` (U, V or W) of the projection of an object's point.
HWY_INLINE VF form(const ObjectMap& c, int row, VF x, VF y, VF z) {
  const DF d;
  return hn::MulAdd(hn::Set(d, c.of[row][2]), z,
                    hn::MulAdd(hn::Set(d, c.of[row][1]), y,
                               hn::MulAdd(hn::Set(d, c.of[row][0]), x, hn::Set(d, c.at[row]))));
}

ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes) {
  const DF d;
  const int lanes = int(hn::Lanes(d));
  ContactBits bits{0, 0};
  for (int first = 0; first < Bvh::kArity; first += lanes) {
    VF center[3], half[3];
    for (std::size_t axis = 0; axis < 3; ++axis)
      center[axis] = hn::Load(d, boxes.center_m[axis].data() + first),
      half[axis] = hn::Load(d, boxes.half_m[axis].data() + first);
    const MF present = hn::Ge(half[0], hn::Zero(d));
    MF free = hn::Not(present), solid = present;
    for (const ObjectMap& c : cameras) {
      const VF w = form(c, 2, center[0], center[1], center[2]);
      VF off_w = hn::Zero(d);
      for (int k = 0; k < 3; ++k)
        off_w = hn::MulAdd(hn::Abs(hn::Set(d, c.of[2][k])), half[k], off_w);
      const VF slack_w = hn::Set(d, c.slack_w), min_w = hn::Sub(hn::Sub(w, off_w), slack_w),
               per_w = reciprocal(w), per_min_w = reciprocal(min_w);
      const MF certain = hn::Gt(min_w, hn::Set(d, c.min_w));
      const VF u = hn::Mul(form(c, 0, center[0], center[1], center[2]), per_w),
               v = hn::Mul(form(c, 1, center[0], center[1], center[2]), per_w);
      // Bound of a corner's distance from the center's image: U - u W over the minimum of W. It
      // includes the error of the center's W, and so of u, which dominates if the center's image
      // is far outside the map (kFormError in contact_maps.cpp).
      const auto off = [&](int row, VF at) {
        VF sum = hn::Mul(hn::Abs(at), slack_w);
        for (int k = 0; k < 3; ++k)
          sum = hn::MulAdd(
              hn::Abs(hn::NegMulAdd(at, hn::Set(d, c.of[2][k]), hn::Set(d, c.of[row][k]))), half[k],
              sum);
        return hn::Mul(sum, hn::Mul(per_min_w, hn::Set(d, kExtentSlack)));
      };
      const VF off_u = off(0, u), off_v = off(1, v);
      const RectContents contents = classify_rect(c, hn::Sub(u, off_u), hn::Add(u, off_u),
                                                  hn::Sub(v, off_v), hn::Add(v, off_v));
      free = hn::Or(free, hn::Or(hn::And(certain, contents.free),
                                 hn::Lt(hn::Add(w, off_w), hn::Set(d, c.max_behind_w))));
      solid = hn::And(solid, hn::And(certain, contents.solid));
      if (hn::AllTrue(d, free)) break;
    }
    bits.free |= bits_of(free) << first;
    bits.solid |= bits_of(hn::AndNot(free, solid)) << first;
  }
  return bits;
}

ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf,
                          int triangles) {
  const DF d;
  const int lanes = int(hn::Lanes(d));
  ContactBits bits{0, 0};
  for (int first = 0; first < triangles; first += lanes) {
    VF p[3][3];
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        p[k][axis] = hn::Load(d, leaf.vertices_m[k][axis].data() + first);
    MF free = nothing(), solid = everything();
    for (const ObjectMap& c : cameras) {
      VF low_u, high_u, low_v, high_v, min_w, max_w;
      for (int k = 0; k < 3; ++k) {
        const VF w = form(c, 2, p[k][0], p[k][1], p[k][2]), per_w = reciprocal(w);
        const VF u = hn::Mul(form(c, 0, p[k][0], p[k][1], p[k][2]), per_w),
                 v = hn::Mul(form(c, 1, p[k][0], p[k][1], p[k][2]), per_w);
        low_u = k ? hn::Min(low_u, u) : u, high_u = k ? hn::Max(high_u, u) : u;
        low_v = k ? hn::Min(low_v, v) : v, high_v = k ? hn::Max(high_v, v) : v;
        min_w = k ? hn::Min(min_w, w) : w, max_w = k ? hn::Max(max_w, w) : w;
      }
      const MF certain = hn::Gt(min_w, hn::Set(d, c.min_w));
      const RectContents contents = classify_rect(c, low_u, high_u, low_v, high_v);
      free = hn::Or(
          free, hn::Or(hn::And(certain, contents.free), hn::Lt(max_w, hn::Set(d, c.max_behind_w))));
      solid = hn::And(solid, hn::And(certain, contents.solid));
      if (hn::AllTrue(d, free)) break;
    }
    bits.free |= bits_of(free) << first;
    bits.solid |= bits_of(hn::AndNot(free, solid)) << first;
  }
  const std::uint32_t present = triangles >= 32 ? ~0u : (1u << triangles) - 1;
  return {bits.free & present, bits.solid & present};
}

// Row `row` (U, V or W) of the projection of a triangle's point.
HWY_INLINE VF form(const TriangleMap& c, int row, VF a, VF b) {
  const DF d;
  return hn::MulAdd(hn::Set(d, c.by_b[row]), b,
                    hn::MulAdd(hn::Set(d, c.by_a[row]), a, hn::Set(d, c.at[row])));
}

// Appends the cells in the mask.
HWY_INLINE void append(Cells& to, MF which, VF a, VF b, VF sigma) {
  const DF d;
  hn::CompressStore(a, which, d, to.a.data() + to.count);
  hn::CompressStore(b, which, d, to.b.data() + to.count);
  to.count += hn::CompressStore(sigma, which, d, to.sigma.data() + to.count);
}

void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  mixed.reserve_more(cells.count), solid.reserve_more(cells.count);
  for (std::size_t first = 0; first < cells.count; first += lanes) {
    const VF a = hn::LoadU(d, cells.a.data() + first), b = hn::LoadU(d, cells.b.data() + first),
             sigma = hn::LoadU(d, cells.sigma.data() + first);
    const VF step = hn::Mul(sigma, hn::Set(d, h));
    const MF present = hn::FirstN(d, cells.count - first);
    MF free = hn::Not(present), all = present;
    for (const TriangleMap& c : cameras) {
      VF corner[3][3];  // U, V, W of the three corners
      for (int row = 0; row < 3; ++row) {
        corner[row][0] = form(c, row, a, b);
        corner[row][1] = hn::MulAdd(step, hn::Set(d, c.by_a[row]), corner[row][0]);
        corner[row][2] = hn::MulAdd(step, hn::Set(d, c.by_b[row]), corner[row][0]);
      }
      VF u[3], v[3];
      for (int k = 0; k < 3; ++k) {
        const VF per_w = reciprocal(corner[2][k]);
        u[k] = hn::Mul(corner[0][k], per_w), v[k] = hn::Mul(corner[1][k], per_w);
      }
      const RectContents contents =
          classify_rect(c, hn::Min(u[0], hn::Min(u[1], u[2])), hn::Max(u[0], hn::Max(u[1], u[2])),
                        hn::Min(v[0], hn::Min(v[1], v[2])), hn::Max(v[0], hn::Max(v[1], v[2])));
      free = hn::Or(free, contents.free);
      all = hn::And(all, contents.solid);
      if (hn::AllTrue(d, free)) break;
    }
    all = hn::AndNot(free, all);
    append(solid, all, a, b, sigma);
    append(mixed, hn::Not(hn::Or(free, all)), a, b, sigma);
  }
}

void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const VF third = hn::Set(d, h / 3), zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  inside.reserve_more(cells.count), uncertain.reserve_more(cells.count);
  for (std::size_t first = 0; first < cells.count; first += lanes) {
    const VF a = hn::LoadU(d, cells.a.data() + first), b = hn::LoadU(d, cells.b.data() + first),
             sigma = hn::LoadU(d, cells.sigma.data() + first);
    const VF center_a = hn::MulAdd(sigma, third, a), center_b = hn::MulAdd(sigma, third, b);
    MF in = hn::FirstN(d, cells.count - first), near_border = nothing();
    for (const TriangleMap& c : cameras) {
      const VF eps = hn::Set(d, c.eps_px), per_w = reciprocal(form(c, 2, center_a, center_b));
      const VF u = hn::Mul(form(c, 0, center_a, center_b), per_w),
               v = hn::Mul(form(c, 1, center_a, center_b), per_w);
      VF fu = hn::Floor(u), fv = hn::Floor(v);
      const VF off_u = hn::Sub(u, fu), off_v = hn::Sub(v, fv);
      const MF near = hn::Or(hn::Lt(hn::Min(off_u, off_v), eps),
                             hn::Gt(hn::Max(off_u, off_v), hn::Sub(one, eps)));
      const VF inside_by = extent_at(c, fu, fv);
      // Near a border, the exact image may be in the next pixel.
      near_border = hn::Or(near_border, hn::And(in, near));
      in = hn::And(in, hn::Or(near, hn::Lt(inside_by, zero)));
      if (hn::AllFalse(d, in)) break;
    }
    near_border = hn::And(near_border, in);
    append(inside, hn::AndNot(near_border, in), a, b, sigma);
    append(uncertain, near_border, a, b, sigma);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::collision {
namespace {
HWY_EXPORT(classify_boxes);
HWY_EXPORT(classify_leaf);
HWY_EXPORT(classify_cells);
HWY_EXPORT(classify_centers);
}  // namespace

ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes) {
  return HWY_DYNAMIC_DISPATCH(classify_boxes)(cameras, boxes);
}
ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf,
                          int triangles) {
  return HWY_DYNAMIC_DISPATCH(classify_leaf)(cameras, leaf, triangles);
}
void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid) {
  HWY_DYNAMIC_DISPATCH(classify_cells)(cameras, cells, h, mixed, solid);
}
void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain) {
  HWY_DYNAMIC_DISPATCH(classify_centers)(cameras, cells, h, inside, uncertain);
}

}  // namespace fivepipe::collision
#endif
