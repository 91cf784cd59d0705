#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/box_reach.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstring>

#include "common/hull/box_reach.h"

#ifndef FIVEPIPE_BOX_REACH_ONCE
#define FIVEPIPE_BOX_REACH_ONCE
namespace fivepipe {
namespace {

constexpr int kWordsPerStep = 8, kCountBits = 4, kLevels = int(kReaches_px.size());
static_assert(kLevels == 1 << kCountBits);

// `rows` rows of `words` words, a multiple of kWordsPerStep. A bit of `empty`: no object pixel; of `object`: one.
struct Planes {
  int rows, words;
  const std::uint64_t *empty, *object;
};

}  // namespace
}  // namespace fivepipe
#endif

HWY_BEFORE_NAMESPACE();
namespace fivepipe {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D64 = hn::CappedTag<std::uint64_t, kWordsPerStep>;
using D8 = hn::CappedTag<std::uint8_t, 64>;

// Level k of a row: pixels whose box of side kReaches_px[k] is all ones. Rows come against the box's way, so that the rows that a
// box reaches over are there: level k of row r takes level k - 1 of the row `apart` before it, eroded along the row.
template <bool kLeft>
class Levels {
 public:
  Levels(int words, std::uint64_t outside) : words_(words), pitch_(words + 2), outside_(std::size_t(pitch_), outside), now_(std::size_t(kLevels) * pitch_, outside) {
    std::size_t rows = 0;
    for (int k = 1; k < kLevels; ++k) {
      first_row_[k] = rows;
      rows += std::size_t(apart(k));
    }
    across_.resize(rows * pitch_, outside);
  }

  // Of the row at hand; each with a word before and after it.
  std::uint64_t* level(int k) { return now_.data() + std::size_t(k) * pitch_ + 1; }

  // level(0) has been written, of the n-th row.
  void advance(int n) {
    const D64 d;
    for (int k = 1; k < kLevels; ++k) {
      const int by = apart(k);
      std::uint64_t* ring = across_.data() + (first_row_[k] + std::size_t(n % by)) * pitch_ + 1;  // of the row `by` rows before, then of this one
      const std::uint64_t* below = level(k - 1);
      std::uint64_t* out = level(k);
      for (int w = 0; w < words_; w += int(hn::Lanes(d))) {
        const auto x = hn::LoadU(d, below + w);
        const auto beside = kLeft ? hn::Or(hn::ShiftLeftSame(x, by), hn::ShiftRightSame(hn::LoadU(d, below + w - 1), 64 - by))
                                  : hn::Or(hn::ShiftRightSame(x, by), hn::ShiftLeftSame(hn::LoadU(d, below + w + 1), 64 - by));
        const auto both = hn::And(x, beside);
        hn::StoreU(hn::And(both, hn::LoadU(d, ring + w)), d, out + w);
        hn::StoreU(both, d, ring + w);
      }
    }
  }

 private:
  static int apart(int k) { return kReaches_px[std::size_t(k)] - kReaches_px[std::size_t(k - 1)]; }

  int words_, pitch_;
  std::array<std::size_t, kLevels> first_row_{};
  std::vector<std::uint64_t> outside_, now_, across_;
};

// How many levels beyond the first hold a bit, in binary, a row of each binary digit after the other. Levels are nested: digit b is
// set where an odd multiple of 2^b holds the bit and the next even one does not.
template <bool kLeft>
HWY_INLINE void count_levels(Levels<kLeft>& empty, Levels<kLeft>& object, int words, std::uint64_t* counts) {
  const D64 d;
  for (int w = 0; w < words; w += int(hn::Lanes(d))) {
    const auto level = [&](int n) { return hn::Or(hn::LoadU(d, empty.level(n) + w), hn::LoadU(d, object.level(n) + w)); };
    for (int b = 0; b < kCountBits; ++b) {
      auto digit = hn::Zero(d);
      for (int n = 1 << b; n < kLevels; n += 2 << b) {
        const int next = n + (1 << b);
        digit = hn::Or(digit, next < kLevels ? hn::AndNot(level(next), level(n)) : level(n));
      }
      hn::StoreU(digit, d, counts + b * words + w);
    }
  }
}

// A row's bytes from the digits.
HWY_INLINE void store_reaches(const std::uint64_t* counts, const std::uint64_t* object, int words, int used_words, std::int8_t* out) {
  const D8 d;
  alignas(16) std::uint8_t reaches[16];
  for (int k = 0; k < kLevels; ++k) reaches[k] = std::uint8_t(kReaches_px[std::size_t(k)]);
  const auto table = hn::LoadDup128(d, reaches);
  for (int w = 0; w < used_words; ++w)
    for (int part = 0; part < 64; part += int(hn::Lanes(d))) {
      const auto bits = [&](const std::uint64_t* row) { return hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(row + w) + part / 8); };
      auto level = hn::Zero(d);
      for (int b = 0; b < kCountBits; ++b) level = hn::Or(level, hn::IfThenElseZero(bits(counts + b * words), hn::Set(d, std::uint8_t(1 << b))));
      const auto reach = hn::TableLookupBytes(table, level);
      hn::StoreU(hn::IfThenElse(bits(object), hn::Sub(hn::Zero(d), reach), reach), d, reinterpret_cast<std::uint8_t*>(out) + w * 64 + part);
    }
}

template <bool kLeft>
void reaches_of(bool up, const Planes& pixels, int used_words, std::int8_t* out, int stride) {
  Levels<kLeft> empty(pixels.words, ~std::uint64_t{0}), object(pixels.words, 0);
  std::vector<std::uint64_t> counts(static_cast<std::size_t>(kCountBits * pixels.words));
  for (int n = 0; n < pixels.rows; ++n) {
    const int row = up ? n : pixels.rows - 1 - n;
    const std::size_t at = std::size_t(row) * pixels.words, bytes = sizeof(std::uint64_t) * pixels.words;
    std::memcpy(empty.level(0), pixels.empty + at, bytes);
    std::memcpy(object.level(0), pixels.object + at, bytes);
    empty.advance(n);
    object.advance(n);
    count_levels(empty, object, pixels.words, counts.data());
    store_reaches(counts.data(), pixels.object + at, pixels.words, used_words, out + std::ptrdiff_t(row) * stride);
  }
}

void reaches(bool left, bool up, const Planes& pixels, int used_words, std::int8_t* out, int stride) {
  if (left) reaches_of<true>(up, pixels, used_words, out, stride);
  else reaches_of<false>(up, pixels, used_words, out, stride);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe {
namespace {
HWY_EXPORT(reaches);
}  // namespace

void BoxReach::assign(const ObjectPixels& pixels) {
  made_ = {};
  bounds_ = pixels.bounds();
  stored_ = {};
  if (bounds_.empty()) return;
  const auto word_of = [](int u) { return (u >= 0 ? u : u - 63) / 64; };
  const int first_word = word_of(bounds_.u0_px - kMargin_px), last_word = word_of(bounds_.u1_px - 1 + kMargin_px), used_words = last_word - first_word + 1;
  words_ = kWordsPerStep * ((used_words + kWordsPerStep - 1) / kWordsPerStep);
  stored_ = {64 * first_word, bounds_.v0_px - kMargin_px, 64 * (last_word + 1), bounds_.v1_px + kMargin_px};
  object_.assign(std::size_t(words_) * stored_.height_px(), 0);
  empty_.assign(object_.size(), ~std::uint64_t{0});
  for (int v = bounds_.v0_px; v < bounds_.v1_px; ++v) {
    const std::uint64_t* from = pixels.words().data() + std::size_t(v) * pixels.words_per_row();
    const std::size_t to = std::size_t(v - stored_.v0_px) * words_;
    for (int w = std::max(first_word, 0); w <= std::min(last_word, pixels.words_per_row() - 1); ++w) {
      object_[to + std::size_t(w - first_word)] = from[w];
      empty_[to + std::size_t(w - first_word)] = ~from[w];
    }
  }
  stride_ = 64 * used_words;
  box_bytes_ = std::size_t(stride_) * stored_.height_px() + 64;
  if (bytes_size_ < kBoxes * box_bytes_) {
    bytes_size_ = kBoxes * box_bytes_;
    bytes_ = std::make_unique_for_overwrite<std::int8_t[]>(bytes_size_);
  }
}

void BoxReach::make(Box box) {
  const bool left = box == Box::left_down || box == Box::left_up, up = box == Box::right_up || box == Box::left_up;
  if (!bounds_.empty())
    HWY_DYNAMIC_DISPATCH(reaches)(left, up, {stored_.height_px(), words_, empty_.data(), object_.data()}, stride_ / 64, bytes_.get() + std::size_t(box) * box_bytes_, stride_);
  made_[std::size_t(box)] = true;
}

void BoxReach::make_all() {
  for (int box = 0; box < kBoxes; ++box)
    if (!has(Box(box))) make(Box(box));
}

int BoxReach::around(int u_px, int v_px) const {
  int least = kReaches_px.back();
  bool object = false;
  for (int box = 0; box < kBoxes; ++box) {
    const int r = at(Box(box), u_px, v_px);
    object = r < 0;
    least = std::min(least, std::abs(r));
  }
  return object ? -least : least;
}

}  // namespace fivepipe
#endif
