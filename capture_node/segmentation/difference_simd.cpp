#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "capture_node/segmentation/difference_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <numbers>

#include "capture_node/segmentation/difference.h"

HWY_BEFORE_NAMESPACE();
namespace fivepipe::capture {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

struct Bits {
  std::uint64_t differs = 0, above = 0;
};
// The levels of 64 pixels, and by how much each is farther from its mean than its tolerance: in
// either direction, and brighter.
struct Compared {
  alignas(64) WordLevels levels;  // compensated
  alignas(64) WordLevels excess, above;
};

// As compensated() in gain.h, for the even and the odd bytes, each with its own factor.
template <class D, class Wide = hn::Vec<hn::Repartition<std::uint16_t, D>>>
HWY_INLINE hn::Vec<D> compensate(D d, hn::Vec<D> level, Wide even_factor, Wide odd_factor) {
  const hn::Repartition<std::uint16_t, D> wide;
  const auto high = hn::Set(wide, 0xff00), half = hn::Set(wide, 8), most = hn::Set(wide, 255);
  const auto bytes = hn::BitCast(wide, level);
  const auto of = [&](auto shifted, auto factor) {
    return hn::Min(hn::ShiftRight<4>(hn::Add(hn::MulHigh(shifted, factor), half)), most);
  };
  const auto even = of(hn::ShiftLeft<8>(bytes), even_factor),
             odd = of(hn::And(bytes, high), odd_factor);
  return hn::BitCast(d, hn::Or(even, hn::ShiftLeft<8>(odd)));
}

// The factors of the even and of the odd bytes of a word.
struct Factors {
  alignas(64) std::array<std::uint16_t, 96> even, odd;
};
Factors factors_of(const InverseGain& inverse_gain) {
  Factors factors;
  for (std::size_t i = 0; i < 96; ++i) {
    factors.even[i] = inverse_gain[2 * i % 3];
    factors.odd[i] = inverse_gain[(2 * i + 1) % 3];
  }
  return factors;
}

// The level, brought to the brightness of the background. i: of its first byte in the word.
template <bool kCompensates, class D>
HWY_INLINE hn::Vec<D> compensated_at(D d, hn::Vec<D> level, const Factors& factors, std::size_t i) {
  if (!kCompensates) return level;
  const hn::Repartition<std::uint16_t, D> wide;
  return compensate(d, level, hn::LoadU(wide, factors.even.data() + i / 2),
                    hn::LoadU(wide, factors.odd.data() + i / 2));
}

// Whether a level of the word is farther from its mean than `tolerance`. Saturated levels count
// too, so a word without any has no pixel that differs.
template <bool kCompensates>
HWY_INLINE bool any_beyond(const std::uint8_t* bgr, const WordLevels& mean, const Factors& factors,
                           std::uint8_t tolerance) {
  const hn::CappedTag<std::uint8_t, 64> d;
  const auto within = hn::Set(d, tolerance);
  auto beyond = hn::Zero(d);
  for (std::size_t i = 0; i < 192; i += hn::Lanes(d)) {
    const auto level = compensated_at<kCompensates>(d, hn::LoadU(d, bgr + i), factors, i);
    const auto of_background = hn::LoadU(d, mean.data() + i);
    // One of the saturating subtractions is zero.
    const auto distance =
        hn::Or(hn::SaturatedSub(level, of_background), hn::SaturatedSub(of_background, level));
    beyond = hn::Or(beyond, hn::SaturatedSub(distance, within));
  }
  return !hn::AllTrue(d, hn::Eq(beyond, hn::Zero(d)));
}

// Compares each level of the word with its own tolerance. Returns whether one is beyond it.
template <bool kCompensates>
HWY_INLINE bool compare(const std::uint8_t* bgr, const WordLevels& mean,
                        const WordLevels& tolerances, const Factors& factors, Compared& compared) {
  const hn::CappedTag<std::uint8_t, 64> d;
  auto any = hn::Zero(d);
  for (std::size_t i = 0; i < 192; i += hn::Lanes(d)) {
    const auto raw = hn::LoadU(d, bgr + i);
    const auto level = compensated_at<kCompensates>(d, raw, factors, i);
    const auto of_background = hn::LoadU(d, mean.data() + i),
               tolerance = hn::LoadU(d, tolerances.data() + i);
    const auto above = hn::SaturatedSub(hn::SaturatedSub(level, of_background), tolerance),
               below = hn::SaturatedSub(hn::SaturatedSub(of_background, level), tolerance);
    const auto is_saturated = hn::Eq(raw, hn::Set(d, 255));
    const auto excess = hn::Or(above, hn::IfThenZeroElse(is_saturated, below));
    hn::Store(level, d, compared.levels.data() + i);
    hn::Store(above, d, compared.above.data() + i);
    hn::Store(excess, d, compared.excess.data() + i);
    any = hn::Or(any, excess);
  }
  return !hn::AllTrue(d, hn::Eq(any, hn::Zero(d)));
}

template <class D>
HWY_INLINE std::uint64_t bits_of(D d, hn::Mask<D> mask) {
  std::uint64_t bits = 0;
  hn::StoreMaskBits(d, mask, reinterpret_cast<std::uint8_t*>(&bits));
  return bits;
}

HWY_INLINE LevelPlanes planes_of(const WordLevels& levels) {
  const hn::CappedTag<std::uint8_t, 64> d;
  LevelPlanes planes;
  for (std::size_t i = 0; i < 64; i += hn::Lanes(d)) {
    hn::Vec<decltype(d)> channel[3];
    hn::LoadInterleaved3(d, levels.data() + 3 * i, channel[0], channel[1], channel[2]);
    for (std::size_t c = 0; c < 3; ++c) hn::StoreU(channel[c], d, planes[c].data() + i);
  }
  return planes;
}

// Combines the channels of each pixel. excess: of the channel farthest from its mean.
HWY_INLINE Bits pixels_of(const Compared& compared, std::array<std::uint8_t, 64>& excess) {
  const hn::CappedTag<std::uint8_t, 64> d;
  const auto zero = hn::Zero(d);
  Bits bits;
  for (std::size_t i = 0; i < 64; i += hn::Lanes(d)) {
    hn::Vec<decltype(d)> b, g, r;
    hn::LoadInterleaved3(d, compared.excess.data() + 3 * i, b, g, r);
    const auto most = hn::Max(hn::Max(b, g), r);
    hn::StoreU(most, d, excess.data() + i);
    bits.differs |= bits_of(d, hn::Ne(most, zero)) << i;
    hn::LoadInterleaved3(d, compared.above.data() + 3 * i, b, g, r);
    bits.above |= bits_of(d, hn::Ne(hn::Or(hn::Or(b, g), r), zero)) << i;
  }
  return bits;
}

HWY_INLINE std::uint64_t strong_bits(const std::array<std::uint8_t, 64>& excess,
                                     const std::array<std::uint8_t, 64>& strong_excess) {
  const hn::CappedTag<std::uint8_t, 64> d;
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < 64; i += hn::Lanes(d)) {
    const auto beyond =
        hn::SaturatedSub(hn::LoadU(d, excess.data() + i), hn::LoadU(d, strong_excess.data() + i));
    bits |= bits_of(d, hn::Ne(beyond, hn::Zero(d))) << i;
  }
  return bits;
}

// Those of the pixels `differs` whose levels no box holds.
HWY_INLINE std::uint64_t not_held(std::uint64_t differs, const LevelPlanes& levels,
                                  const std::vector<DifferenceTables::Boxes>& boxes) {
  const hn::CappedTag<std::uint8_t, 64> d;
  for (const auto& [low, high] : boxes) {
    if (differs == 0) break;
    for (std::size_t i = 0; i < 64; i += hn::Lanes(d)) {
      auto outside = hn::Zero(d);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto level = hn::LoadU(d, levels[c].data() + i);
        outside = hn::Or(outside, hn::SaturatedSub(level, hn::LoadU(d, high[c].data() + i)));
        outside = hn::Or(outside, hn::SaturatedSub(hn::LoadU(d, low[c].data() + i), level));
      }
      differs &= ~(bits_of(d, hn::Eq(outside, hn::Zero(d))) << i);
    }
  }
  return differs;
}

// The pixels that look like shadow. The products are exact in float, so each instruction set gives
// the same bits.
HWY_INLINE std::uint64_t shadow_bits(const LevelPlanes& levels, const LevelPlanes& background,
                                     float min_brightness, float max_tint) {
  const hn::CappedTag<float, 16> d;
  const hn::Rebind<std::int32_t, decltype(d)> d32;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  const auto squared_levels = hn::Set(d, kShadowColour_levels * kShadowColour_levels),
             squared_tint = hn::Set(d, max_tint * max_tint), least = hn::Set(d, min_brightness);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < 64; i += hn::Lanes(d)) {
    auto xr = hn::Zero(d), rr = xr, xx = xr;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto load = [&](const LevelPlanes& planes) {
        return hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d8, planes[c].data() + i)));
      };
      const auto x = load(levels), r = load(background);
      xr = hn::Add(xr, hn::Mul(x, r));
      rr = hn::Add(rr, hn::Mul(r, r));
      xx = hn::Add(xx, hn::Mul(x, x));
    }
    const auto along = hn::Mul(hn::Div(xr, hn::Max(rr, hn::Set(d, 1.0f))), xr);
    const auto is_bright = hn::Ge(xr, hn::Mul(least, rr));
    const auto has_colour =
        hn::Le(hn::Sub(xx, along), hn::Max(squared_levels, hn::Mul(squared_tint, along)));
    bits |= bits_of(d, hn::And(is_bright, has_colour)) << i;
  }
  return bits;
}

template <bool kCompensates>
void classify(const cv::Mat& image, const DifferenceTables& tables,
              const DifferenceRequest& request, Difference& result) {
  const int words = tables.words_per_row;
  std::uint64_t *const differs = result.differs.mutable_words().data(),
                       *const strongly = result.strongly.mutable_words().data(),
                       *const shadow = result.shadow.mutable_words().data();
  std::array<std::uint8_t, 192> padded{};
  const Factors factors = factors_of(request.inverse_gain);
  const auto max_tint = float(std::tan(request.shadow_tint_degrees * std::numbers::pi / 180));
  Compared compared;
  std::array<std::uint8_t, 64> excess;
  auto moving = tables.moving.begin();
  for (int v = 0; v < tables.height_px; ++v)
    for (int w = 0; w < words; ++w) {
      const int word = v * words + w;
      while (moving != tables.moving.end() && moving->word < word) ++moving;
      const auto at = std::size_t(word);
      const std::uint64_t within = request.within ? request.within->words()[at] : ~std::uint64_t(0);
      if (within == 0) continue;
      const std::uint8_t* bgr = image.ptr(v) + 192 * w;
      if (const int pixels = tables.width_px - 64 * w; pixels < 64) {
        std::memcpy(padded.data(), bgr, std::size_t(3 * pixels));
        bgr = padded.data();
      }
      if (!any_beyond<kCompensates>(bgr, tables.mean[at], factors, tables.tolerance[at]) ||
          !compare<kCompensates>(bgr, tables.mean[at], tables.tolerances[at], factors, compared))
        continue;
      Bits bits = pixels_of(compared, excess);
      bits.differs &= within;
      if (bits.differs == 0) continue;
      if (moving != tables.moving.end() && moving->word == word)
        bits.differs = not_held(bits.differs, planes_of(compared.levels), moving->boxes);
      differs[at] = bits.differs;
      strongly[at] = bits.differs & strong_bits(excess, tables.strong_excess[at]);
      const std::uint64_t darker = bits.differs & ~bits.above;
      if (darker != 0 && request.shadow_min_brightness < 1)
        shadow[at] = darker & shadow_bits(planes_of(compared.levels), planes_of(tables.mean[at]),
                                          float(request.shadow_min_brightness), max_tint);
    }
}

void classify_image(const cv::Mat& image, const DifferenceTables& tables,
                    const DifferenceRequest& request, Difference& result) {
  if (request.inverse_gain == kNoGain)
    classify<false>(image, tables, request, result);
  else
    classify<true>(image, tables, request, result);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::capture
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::capture {
namespace {
HWY_EXPORT(classify_image);
}  // namespace

Difference difference(const cv::Mat& image_bgr, const DifferenceTables& tables,
                      const DifferenceRequest& request) {
  const int width = tables.width_px, height = tables.height_px;
  assert(image_bgr.type() == CV_8UC3 && image_bgr.cols == width && image_bgr.rows == height);
  assert(!request.within ||
         (request.within->width_px() == width && request.within->height_px() == height));
  Difference result{hull::ObjectPixels(width, height), hull::ObjectPixels(width, height),
                    hull::ObjectPixels(width, height)};
  HWY_DYNAMIC_DISPATCH(classify_image)(image_bgr, tables, request, result);
  return result;
}

}  // namespace fivepipe::capture
#endif
