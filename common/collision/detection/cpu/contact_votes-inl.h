// Lookup of image rectangles in a camera's map, and the combination of the cameras' verdicts by the
// hull rule (contact_simd.h). Each includer compiles this file once per instruction set.
#if defined(FIVEPIPE_CONTACT_VOTES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef FIVEPIPE_CONTACT_VOTES_INL_H
#undef FIVEPIPE_CONTACT_VOTES_INL_H
#else
#define FIVEPIPE_CONTACT_VOTES_INL_H
#endif

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

// A rectangle of image positions [px], widened by their error.
struct Rect {
  VF low_u, high_u, low_v, high_v;
  HWY_INLINE Rect(const ContactMap& c, VF u0, VF u1, VF v0, VF v1) {
    const VF eps = hn::Set(DF(), c.eps_px);
    low_u = hn::Sub(u0, eps), high_u = hn::Add(u1, eps), low_v = hn::Sub(v0, eps),
    high_v = hn::Add(v1, eps);
  }
};

HWY_INLINE RectContents classify_rect(const ContactMap& c, const Rect& rect) {
  const DF d;
  const auto& [low_u, high_u, low_v, high_v] = rect;
  const VF zero = hn::Zero(d);
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

// Combines the cameras' verdicts on shapes by Limits::all. `certain`: the shape is in front of the
// camera; `behind`: it is behind.
class AllVotes {
 public:
  HWY_INLINE AllVotes(MF present, const ContactRule&) : free_(hn::Not(present)), solid_(present) {}
  HWY_INLINE void add(const ContactMap& c, const Rect& rect) {
    const RectContents contents = classify_rect(c, rect);
    free_ = hn::Or(free_, contents.free), solid_ = hn::And(solid_, contents.solid);
  }
  HWY_INLINE void add(const ContactMap& c, const Rect& rect, MF certain, MF behind) {
    const RectContents contents = classify_rect(c, rect);
    free_ = hn::Or(free_, hn::Or(hn::And(certain, contents.free), behind));
    solid_ = hn::And(solid_, hn::And(certain, contents.solid));
  }
  HWY_INLINE bool all_free() const { return hn::AllTrue(DF(), free_); }
  HWY_INLINE MF free() const { return free_; }
  HWY_INLINE MF solid() const { return hn::AndNot(free_, solid_); }

 private:
  MF free_, solid_;
};

// The same by Limits::seen.
class SeenVotes {
 public:
  HWY_INLINE SeenVotes(MF present, const ContactRule& rule)
      : free_(hn::Not(present)),
        solid_(rule.unmapped > 0 ? nothing() : present),
        min_seen_(hn::Set(DF(), float(rule.hull.min_seen))),
        may_see_(hn::Set(DF(), float(rule.unmapped))),
        sees_(hn::Zero(DF())) {}
  HWY_INLINE void add(const ContactMap& c, const Rect& rect) {
    add(c, rect, everything(), nothing());
  }
  HWY_INLINE void add(const ContactMap& c, const Rect& rect, MF certain, MF behind) {
    const DF d;
    const VF u0 = hn::Set(d, c.image_begin_u), u1 = hn::Set(d, c.image_end_u),
             v0 = hn::Set(d, c.image_begin_v), v1 = hn::Set(d, c.image_end_v);
    const MF in_image = hn::And(hn::And(hn::Gt(rect.low_u, u0), hn::Lt(rect.high_u, u1)),
                                hn::And(hn::Gt(rect.low_v, v0), hn::Lt(rect.high_v, v1)));
    const MF off_image = hn::Or(hn::Or(hn::Lt(rect.high_u, u0), hn::Gt(rect.low_u, u1)),
                                hn::Or(hn::Lt(rect.high_v, v0), hn::Gt(rect.low_v, v1)));
    const RectContents contents = classify_rect(c, rect);
    const MF no_object = hn::And(certain, contents.free),
             on_object = hn::And(certain, contents.solid);
    const VF one = hn::Set(d, 1.0f);
    free_ = hn::Or(free_, hn::And(no_object, in_image));
    may_see_ = hn::Add(may_see_, hn::IfThenZeroElse(hn::Or(no_object, behind), one));
    sees_ = hn::Add(sees_, hn::IfThenElseZero(on_object, one));
    solid_ = hn::And(solid_, hn::Or(on_object, hn::Or(behind, hn::And(certain, off_image))));
  }
  HWY_INLINE bool all_free() const { return hn::AllTrue(DF(), free_); }
  HWY_INLINE MF free() const { return hn::Or(free_, hn::Lt(may_see_, min_seen_)); }
  HWY_INLINE MF solid() const {
    return hn::AndNot(free(), hn::And(solid_, hn::Ge(sees_, min_seen_)));
  }

 private:
  MF free_, solid_;
  VF min_seen_;
  VF may_see_;  // number of cameras that may see a point of the shape on their object
  VF sees_;     // number of cameras that see all of it on their object
};

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::collision
HWY_AFTER_NAMESPACE();

#endif
