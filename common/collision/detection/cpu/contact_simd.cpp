#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/collision/detection/cpu/contact_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/collision/detection/cpu/contact_simd.h"
#include "common/collision/detection/cpu/contact_votes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::collision {
namespace HWY_NAMESPACE {
namespace {

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

template <class Votes>
ContactBits classify_boxes_by(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes,
                              const ContactRule& rule) {
  const DF d;
  const int lanes = int(hn::Lanes(d));
  ContactBits bits{0, 0};
  for (int first = 0; first < Bvh::kArity; first += lanes) {
    VF center[3], half[3];
    for (std::size_t axis = 0; axis < 3; ++axis)
      center[axis] = hn::Load(d, boxes.center_m[axis].data() + first),
      half[axis] = hn::Load(d, boxes.half_m[axis].data() + first);
    Votes votes(hn::Ge(half[0], hn::Zero(d)), rule);
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
      votes.add(c,
                Rect(c, hn::Sub(u, off_u), hn::Add(u, off_u), hn::Sub(v, off_v), hn::Add(v, off_v)),
                certain, hn::Lt(hn::Add(w, off_w), hn::Set(d, c.max_behind_w)));
      if (votes.all_free()) break;
    }
    bits.free |= bits_of(votes.free()) << first;
    bits.solid |= bits_of(votes.solid()) << first;
  }
  return bits;
}

template <class Votes>
ContactBits classify_leaf_by(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf,
                             int triangles, const ContactRule& rule) {
  const DF d;
  const int lanes = int(hn::Lanes(d));
  ContactBits bits{0, 0};
  for (int first = 0; first < triangles; first += lanes) {
    VF p[3][3];
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        p[k][axis] = hn::Load(d, leaf.vertices_m[k][axis].data() + first);
    Votes votes(everything(), rule);
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
      votes.add(c, Rect(c, low_u, high_u, low_v, high_v), hn::Gt(min_w, hn::Set(d, c.min_w)),
                hn::Lt(max_w, hn::Set(d, c.max_behind_w)));
      if (votes.all_free()) break;
    }
    bits.free |= bits_of(votes.free()) << first;
    bits.solid |= bits_of(votes.solid()) << first;
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

template <class Votes>
void classify_cells_by(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                       Cells& mixed, Cells& solid, const ContactRule& rule) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  mixed.reserve_more(cells.count), solid.reserve_more(cells.count);
  for (std::size_t first = 0; first < cells.count; first += lanes) {
    const VF a = hn::LoadU(d, cells.a.data() + first), b = hn::LoadU(d, cells.b.data() + first),
             sigma = hn::LoadU(d, cells.sigma.data() + first);
    const VF step = hn::Mul(sigma, hn::Set(d, h));
    Votes votes(hn::FirstN(d, cells.count - first), rule);
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
      votes.add(c, Rect(c, hn::Min(u[0], hn::Min(u[1], u[2])), hn::Max(u[0], hn::Max(u[1], u[2])),
                        hn::Min(v[0], hn::Min(v[1], v[2])), hn::Max(v[0], hn::Max(v[1], v[2]))));
      if (votes.all_free()) break;
    }
    const MF free = votes.free(), all = votes.solid();
    append(solid, all, a, b, sigma);
    append(mixed, hn::Not(hn::Or(free, all)), a, b, sigma);
  }
}

// The pixel of a part's center in a camera. Near a border, the exact image may be in the next
// pixel.
struct Center {
  MF near_border, in_image;
  VF inside_by;  // the skip map at the pixel
};
template <bool kSeen>
HWY_INLINE Center center_in(const TriangleMap& c, VF center_a, VF center_b) {
  const DF d;
  const VF eps = hn::Set(d, c.eps_px), per_w = reciprocal(form(c, 2, center_a, center_b));
  const VF u = hn::Mul(form(c, 0, center_a, center_b), per_w),
           v = hn::Mul(form(c, 1, center_a, center_b), per_w);
  VF fu = hn::Floor(u), fv = hn::Floor(v);
  const VF off_u = hn::Sub(u, fu), off_v = hn::Sub(v, fv);
  Center center;
  center.near_border = hn::Or(hn::Lt(hn::Min(off_u, off_v), eps),
                              hn::Gt(hn::Max(off_u, off_v), hn::Sub(hn::Set(d, 1.0f), eps)));
  center.in_image = center.near_border;  // not used
  if constexpr (kSeen)
    center.in_image = hn::And(
        hn::And(hn::Ge(fu, hn::Set(d, c.image_begin_u)), hn::Lt(fu, hn::Set(d, c.image_end_u))),
        hn::And(hn::Ge(fv, hn::Set(d, c.image_begin_v)), hn::Lt(fv, hn::Set(d, c.image_end_v))));
  center.inside_by = extent_at(c, fu, fv);
  return center;
}

template <bool kSeen>
void classify_centers_by(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                         Cells& inside, Cells& uncertain, const ContactRule& rule) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const VF third = hn::Set(d, h / 3), zero = hn::Zero(d), one = hn::Set(d, 1.0f),
           min_seen = hn::Set(d, float(rule.hull.min_seen));
  inside.reserve_more(cells.count), uncertain.reserve_more(cells.count);
  for (std::size_t first = 0; first < cells.count; first += lanes) {
    const VF a = hn::LoadU(d, cells.a.data() + first), b = hn::LoadU(d, cells.b.data() + first),
             sigma = hn::LoadU(d, cells.sigma.data() + first);
    const VF center_a = hn::MulAdd(sigma, third, a), center_b = hn::MulAdd(sigma, third, b);
    MF in = hn::FirstN(d, cells.count - first), near_border = nothing();
    VF may_see = zero;
    for (const TriangleMap& c : cameras) {
      const Center center = center_in<kSeen>(c, center_a, center_b);
      near_border = hn::Or(near_border, hn::And(in, center.near_border));
      MF keeps = hn::Or(center.near_border, hn::Lt(center.inside_by, zero));
      if constexpr (kSeen) {
        may_see = hn::Add(may_see, hn::IfThenElseZero(keeps, one));
        keeps = hn::Or(keeps, hn::Not(center.in_image));
      }
      in = hn::And(in, keeps);
      if (hn::AllFalse(d, in)) break;
    }
    // Points near a border count as seen, and are then tested in double.
    if constexpr (kSeen) in = hn::And(in, hn::Ge(may_see, min_seen));
    near_border = hn::And(near_border, in);
    append(inside, hn::AndNot(near_border, in), a, b, sigma);
    append(uncertain, near_border, a, b, sigma);
  }
}

ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes,
                           const ContactRule& rule) {
  return rule.hull.limits == hull::Limits::all ? classify_boxes_by<AllVotes>(cameras, boxes, rule)
                                               : classify_boxes_by<SeenVotes>(cameras, boxes, rule);
}
ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf, int triangles,
                          const ContactRule& rule) {
  return rule.hull.limits == hull::Limits::all
             ? classify_leaf_by<AllVotes>(cameras, leaf, triangles, rule)
             : classify_leaf_by<SeenVotes>(cameras, leaf, triangles, rule);
}
void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid, const ContactRule& rule) {
  rule.hull.limits == hull::Limits::all
      ? classify_cells_by<AllVotes>(cameras, cells, h, mixed, solid, rule)
      : classify_cells_by<SeenVotes>(cameras, cells, h, mixed, solid, rule);
}
void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain, const ContactRule& rule) {
  rule.hull.limits == hull::Limits::all
      ? classify_centers_by<false>(cameras, cells, h, inside, uncertain, rule)
      : classify_centers_by<true>(cameras, cells, h, inside, uncertain, rule);
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

ContactBits classify_boxes(std::span<const ObjectMap> cameras, const Bvh::Boxes& boxes,
                           const ContactRule& rule) {
  return HWY_DYNAMIC_DISPATCH(classify_boxes)(cameras, boxes, rule);
}
ContactBits classify_leaf(std::span<const ObjectMap> cameras, const Bvh::Leaf& leaf, int triangles,
                          const ContactRule& rule) {
  return HWY_DYNAMIC_DISPATCH(classify_leaf)(cameras, leaf, triangles, rule);
}
void classify_cells(std::span<const TriangleMap> cameras, const Cells& cells, float h, Cells& mixed,
                    Cells& solid, const ContactRule& rule) {
  HWY_DYNAMIC_DISPATCH(classify_cells)(cameras, cells, h, mixed, solid, rule);
}
void classify_centers(std::span<const TriangleMap> cameras, const Cells& cells, float h,
                      Cells& inside, Cells& uncertain, const ContactRule& rule) {
  HWY_DYNAMIC_DISPATCH(classify_centers)(cameras, cells, h, inside, uncertain, rule);
}

}  // namespace fivepipe::collision
#endif
