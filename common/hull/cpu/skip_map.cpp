#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/cpu/skip_map.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstring>

#include "common/hull/cpu/skip_map.h"

#ifndef FIVEPIPE_SKIP_MAP_ONCE
#define FIVEPIPE_SKIP_MAP_ONCE
namespace fivepipe::hull {
namespace {

constexpr int kWordsPerStep = 8, kCountBits = 3, kLevels = int(kExtents_px.size());
static_assert(kLevels == 1 << kCountBits);

// Bit planes of `rows` rows with `words` words each, a multiple of kWordsPerStep. A bit of `object`
// is set for an object pixel, a bit of `empty` for any other pixel.
struct Planes {
  int rows, words;
  const std::uint64_t *empty, *object;
};

}  // namespace
}  // namespace fivepipe::hull
#endif

HWY_BEFORE_NAMESPACE();
namespace fivepipe::hull {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D64 = hn::CappedTag<std::uint64_t, kWordsPerStep>;
using D8 = hn::CappedTag<std::uint8_t, 64>;

using V64 = hn::Vec<D64>;

constexpr int apart(int level) {
  return kExtents_px[std::size_t(level)] - kExtents_px[std::size_t(level - 1)];
}

// Erosion of one plane. Level k of a row has the pixels whose box of side kExtents_px[k] is all
// ones. Rows, and the vectors of a row, are processed from the far end of the boxes, so that all
// pixels of a box are processed before its corner: level k combines level k - 1 of its own row and
// of the row `apart` before, each eroded along the row.
template <bool kLeft>
class Erosion {
 public:
  Erosion(int words, std::uint64_t outside) : words_(words), outside_(outside) {
    std::size_t rows = 0;
    for (int k = 1; k < kLevels; ++k) first_row_[k] = rows, rows += std::size_t(apart(k));
    rows_before_.resize(rows * std::size_t(words), outside);
  }

  void begin_row() { beside_.fill(outside_); }

  // Computes the levels of the next vector of the n-th row, whose bits are x. Calls take(k, bits)
  // for each level.
  template <class Take>
  HWY_INLINE void levels(int n, int word, V64 x, const Take& take) {
    const D64 d;
    const int lanes = int(hn::Lanes(d));
    const auto lane = hn::Iota(d, 0);
    const auto neighbour = hn::SetTableIndices(d, neighbours_.data());
    const auto at_end = hn::Eq(lane, hn::Set(d, std::uint64_t(kLeft ? 0 : lanes - 1)));
    take(0, x);
    for (int k = 1; k < kLevels; ++k) {
      const int by = apart(k);
      const V64 turned = hn::TableLookupLanes(x, neighbour);
      const V64 next = hn::IfThenElse(at_end, hn::Set(d, beside_[k]), turned);
      beside_[k] = hn::GetLane(kLeft ? turned : x);
      const V64 shifted = kLeft
                              ? hn::Or(hn::ShiftLeftSame(x, by), hn::ShiftRightSame(next, 64 - by))
                              : hn::Or(hn::ShiftRightSame(x, by), hn::ShiftLeftSame(next, 64 - by));
      const V64 both = hn::And(x, shifted);
      std::uint64_t* before =
          rows_before_.data() + (first_row_[k] + std::size_t(n % by)) * std::size_t(words_) + word;
      x = hn::And(both, hn::LoadU(d, before));
      hn::StoreU(both, d, before);
      take(k, x);
    }
  }

 private:
  static std::array<std::int64_t, kWordsPerStep> make_neighbours() {
    const int lanes = int(hn::Lanes(D64()));
    std::array<std::int64_t, kWordsPerStep> from{};
    for (int i = 0; i < lanes; ++i)
      from[std::size_t(i)] = kLeft ? (i + lanes - 1) % lanes : (i + 1) % lanes;
    return from;
  }

  int words_;
  std::uint64_t outside_;
  std::array<std::size_t, kLevels> first_row_{};
  std::array<std::uint64_t, kLevels> beside_{};  // the word adjacent to the next vector, by level
  std::array<std::int64_t, kWordsPerStep> neighbours_ = make_neighbours();
  std::vector<std::uint64_t> rows_before_;
};

// Binary digit b of the number of levels beyond the first that have a bit set. Levels are nested,
// so the digit is set if the level of an odd multiple of 2^b has the bit and the next even one does
// not.
HWY_INLINE V64 digit(const V64* levels, int b) {
  V64 bits = hn::Zero(D64());
  for (int n = 1 << b; n < kLevels; n += 2 << b) {
    const int next = n + (1 << b);
    bits = hn::Or(bits, next < kLevels ? hn::AndNot(levels[next], levels[n]) : levels[n]);
  }
  return bits;
}

// Computes a row's bytes from the binary digits of the levels.
HWY_INLINE void store_extents(const std::uint64_t* counts, const std::uint64_t* object, int words,
                              int used_words, std::int8_t* out) {
  const D8 d;
  alignas(16) std::uint8_t extents[16] = {};
  for (int k = 0; k < kLevels; ++k) extents[k] = std::uint8_t(kExtents_px[std::size_t(k)]);
  const auto table = hn::LoadDup128(d, extents);
  for (int w = 0; w < used_words; ++w)
    for (int part = 0; part < 64; part += int(hn::Lanes(d))) {
      const auto bits = [&](const std::uint64_t* row) {
        return hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(row + w) + part / 8);
      };
      auto level = hn::Zero(d);
      for (int b = 0; b < kCountBits; ++b)
        level = hn::Or(
            level, hn::IfThenElseZero(bits(counts + b * words), hn::Set(d, std::uint8_t(1 << b))));
      const auto extent = hn::TableLookupBytes(table, level);
      hn::StoreU(hn::IfThenElse(bits(object), hn::Sub(hn::Zero(d), extent), extent), d,
                 reinterpret_cast<std::uint8_t*>(out) + w * 64 + part);
    }
}

template <bool kLeft>
void compute_extents(bool up, const Planes& pixels, int used_words, std::int8_t* out, int stride) {
  const D64 d;
  const int words = pixels.words, lanes = int(hn::Lanes(d)), last = words - lanes;
  Erosion<kLeft> empty(words, ~std::uint64_t{0}), object(words, 0);
  std::vector<std::uint64_t> counts(static_cast<std::size_t>(kCountBits * words));
  for (int n = 0; n < pixels.rows; ++n) {
    const int row = up ? n : pixels.rows - 1 - n;
    const std::uint64_t *empty_row = pixels.empty + std::size_t(row) * words,
                        *object_row = pixels.object + std::size_t(row) * words;
    empty.begin_row();
    object.begin_row();
    for (int step = 0; step < words; step += lanes) {
      const int word = kLeft ? step : last - step;
      V64 levels[kLevels];
      empty.levels(n, word, hn::LoadU(d, empty_row + word),
                   [&](int k, V64 bits) { levels[k] = bits; });
      object.levels(n, word, hn::LoadU(d, object_row + word),
                    [&](int k, V64 bits) { levels[k] = hn::Or(levels[k], bits); });
      for (int b = 0; b < kCountBits; ++b)
        hn::StoreU(digit(levels, b), d, counts.data() + b * words + word);
    }
    store_extents(counts.data(), object_row, words, used_words, out + std::ptrdiff_t(row) * stride);
  }
}

void extents(bool left, bool up, const Planes& pixels, int used_words, std::int8_t* out,
             int stride) {
  if (left)
    compute_extents<true>(up, pixels, used_words, out, stride);
  else
    compute_extents<false>(up, pixels, used_words, out, stride);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe::hull
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe::hull {
namespace {
HWY_EXPORT(extents);
}  // namespace

void SkipMap::assign(const ObjectPixels& pixels) {
  made_ = {};
  bounds_ = pixels.bounds();
  stored_ = {};
  if (bounds_.empty()) return;
  const auto word_of = [](int u) { return (u >= 0 ? u : u - 63) / 64; };
  const int first_word = word_of(bounds_.u0_px - kMargin_px),
            last_word = word_of(bounds_.u1_px - 1 + kMargin_px),
            used_words = last_word - first_word + 1;
  words_ = kWordsPerStep * ((used_words + kWordsPerStep - 1) / kWordsPerStep);
  stored_ = {64 * first_word, bounds_.v0_px - kMargin_px, 64 * (last_word + 1),
             bounds_.v1_px + kMargin_px};
  object_.assign(std::size_t(words_) * stored_.height_px(), 0);
  empty_.assign(object_.size(), ~std::uint64_t{0});
  for (int v = bounds_.v0_px; v < bounds_.v1_px; ++v) {
    const std::uint64_t* from = pixels.words().data() + std::size_t(v) * pixels.words_per_row();
    const std::size_t to = std::size_t(v - stored_.v0_px) * words_;
    for (int w = std::max(first_word, 0); w <= std::min(last_word, pixels.words_per_row() - 1);
         ++w) {
      object_[to + std::size_t(w - first_word)] = from[w];
      empty_[to + std::size_t(w - first_word)] = ~from[w];
    }
  }
  stride_ = 64 * used_words;
  box_bytes_ = std::size_t(stride_) * stored_.height_px() + 64;
  if (bytes_size_ < kQuadrants * box_bytes_) {
    bytes_size_ = kQuadrants * box_bytes_;
    bytes_ = std::make_unique_for_overwrite<std::int8_t[]>(bytes_size_);
  }
}

void SkipMap::make(Quadrant box) {
  const bool left = box == Quadrant::left_down || box == Quadrant::left_up,
             up = box == Quadrant::right_up || box == Quadrant::left_up;
  if (!bounds_.empty()) HWY_DYNAMIC_DISPATCH(extents)
  (left, up, {stored_.height_px(), words_, empty_.data(), object_.data()}, stride_ / 64,
   bytes_.get() + std::size_t(box) * box_bytes_, stride_);
  made_[std::size_t(box)] = true;
}

}  // namespace fivepipe::hull
#endif
