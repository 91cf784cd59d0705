#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/hull/border_distance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "common/hull/border_distance.h"

// Planes of bits: `rows` rows of `words` words, a multiple of kWordsPerStep, each with a word before and after it.
#ifndef FIVEPIPE_BORDER_DISTANCE_ONCE
#define FIVEPIPE_BORDER_DISTANCE_ONCE
namespace fivepipe {
namespace {

constexpr int kWordsPerStep = 4, kCell_px = 8;

struct Planes {
  int rows, words;
  // Of one kind each: bits that are empty, and bits that are object. A bit may be of neither.
  std::vector<std::uint64_t> empty, object;
  int pitch() const { return words + 2; }
  Planes(int rows_, int words_) : rows(rows_), words(words_), empty(std::size_t(rows_) * (words_ + 2)), object(empty.size()) {}
  std::uint64_t* row(std::vector<std::uint64_t>& plane, int r) { return plane.data() + std::size_t(r) * pitch() + 1; }
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

// One step of erosion along the row: a bit stays if its neighbours left and right are set too.
HWY_INLINE void erode_row(const std::uint64_t* in, std::uint64_t* out, int words) {
  const D64 d;
  for (int w = 0; w < words; w += int(hn::Lanes(d))) {
    const auto x = hn::LoadU(d, in + w), before = hn::LoadU(d, in + w - 1), after = hn::LoadU(d, in + w + 1);
    const auto left = hn::Or(hn::ShiftLeft<1>(x), hn::ShiftRight<63>(before)), right = hn::Or(hn::ShiftRight<1>(x), hn::ShiftLeft<63>(after));
    hn::StoreU(hn::And(x, hn::And(left, right)), d, out + w);
  }
}

HWY_INLINE void and_rows(const std::uint64_t* a, const std::uint64_t* b, const std::uint64_t* c, std::uint64_t* out, int words) {
  const D64 d;
  for (int w = 0; w < words; w += int(hn::Lanes(d))) hn::StoreU(hn::And(hn::LoadU(d, a + w), hn::And(hn::LoadU(d, b + w), hn::LoadU(d, c + w))), d, out + w);
}

// The rows of one plane, eroded again and again: level k of row r needs rows r - 1 to r + 1 of level k - 1. Rows are fed in one by
// one; level k follows k rows behind. A ring of rows per level.
template <int kLevels>
class Erosion {
  static constexpr int kRing = 16;
  static_assert(kLevels + 1 < kRing);

 public:
  Erosion(int words, std::uint64_t outside)
      : words_(words), pitch_(words + 2), levels_(std::size_t(kLevels + 1) * kRing * pitch_, outside), across_(levels_.size(), outside), outside_(std::size_t(pitch_), outside) {}

  std::uint64_t* row(int level, int r) { return levels_.data() + place(level, r); }

  // Row r has been written to row(0, r), or lies outside the plane; afterwards level k is there for row r - k.
  void advance(int r, int rows) {
    if (r < rows) erode_row(row(0, r), across_.data() + place(0, r), words_);
    for (int k = 1; k <= kLevels; ++k) {
      const int at = r - k;
      if (at < 0 || at >= rows) continue;
      and_rows(across(k - 1, at - 1, rows), across(k - 1, at, rows), across(k - 1, at + 1, rows), row(k, at), words_);
      if (k < kLevels) erode_row(row(k, at), across_.data() + place(k, at), words_);
    }
  }

 private:
  std::size_t place(int level, int r) const { return (std::size_t(level) * kRing + (r & (kRing - 1))) * pitch_ + 1; }
  const std::uint64_t* across(int level, int r, int rows) const { return r < 0 || r >= rows ? outside_.data() + 1 : across_.data() + place(level, r); }

  int words_, pitch_;
  std::vector<std::uint64_t> levels_, across_, outside_;
};

// How many levels hold a bit, in binary: levels are nested, so bit b of the count is set where an odd multiple of 2^b holds it and
// the next even one does not. Writes a row of kCountBits planes, one after the other.
template <int kLevels, int kCountBits>
HWY_INLINE void count_levels(Erosion<kLevels>& empty, Erosion<kLevels>& object, int r, int words, std::uint64_t* counts) {
  static_assert(kLevels + 1 <= 1 << kCountBits);
  const D64 d;
  for (int w = 0; w < words; w += int(hn::Lanes(d))) {
    const auto level = [&](int n) {  // n = 1 is level 0: a bit of either kind is one step from the border at least
      return hn::Or(hn::LoadU(d, empty.row(n - 1, r) + w), hn::LoadU(d, object.row(n - 1, r) + w));
    };
    for (int b = 0; b < kCountBits; ++b) {
      auto bit = hn::Zero(d);
      for (int n = 1 << b; n <= kLevels + 1; n += 2 << b) {
        const int next = n + (1 << b);
        bit = hn::Or(bit, next <= kLevels + 1 ? hn::AndNot(level(next), level(n)) : level(n));
      }
      hn::StoreU(bit, d, counts + b * words + w);
    }
  }
}

// Calls row_done(r, counts) with each row's distances in kCountBits bit planes, `words` words each.
template <int kLevels, int kCountBits, class RowDone>
void spread(Planes& planes, const RowDone& row_done) {
  Erosion<kLevels> empty(planes.words, ~std::uint64_t{0}), object(planes.words, 0);
  std::vector<std::uint64_t> counts(static_cast<std::size_t>(kCountBits * planes.words));
  for (int r = 0; r < planes.rows + kLevels; ++r) {
    if (r < planes.rows) {
      std::memcpy(empty.row(0, r), planes.row(planes.empty, r), sizeof(std::uint64_t) * planes.words);
      std::memcpy(object.row(0, r), planes.row(planes.object, r), sizeof(std::uint64_t) * planes.words);
    }
    empty.advance(r, planes.rows);
    object.advance(r, planes.rows);
    if (r < kLevels) continue;
    count_levels<kLevels, kCountBits>(empty, object, r - kLevels, planes.words, counts.data());
    row_done(r - kLevels, counts.data());
  }
}

// 64 pixels' or cells' numbers from bit planes `stride` words apart.
template <int kCountBits, class Store>
HWY_INLINE void bytes_from_bits(const std::uint64_t* bits, int stride, const Store& store) {
  const D8 d;
  for (int part = 0; part < 64; part += int(hn::Lanes(d))) {
    auto number = hn::Zero(d);
    for (int b = 0; b < kCountBits; ++b) {
      const auto set = hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(bits + b * stride) + part / 8);
      number = hn::Or(number, hn::IfThenElseZero(set, hn::Set(d, std::uint8_t(1 << b))));
    }
    store(part, number);
  }
}

// Which 8x8 cells are empty, and which all object: one bit a cell.
Planes cells_of(Planes& pixels) {
  const int rows = (pixels.rows + kCell_px - 1) / kCell_px, words = kWordsPerStep * ((pixels.words + 8 * kWordsPerStep - 1) / (8 * kWordsPerStep));
  Planes cells(rows, words);
  const D64 d;
  const hn::Repartition<std::uint8_t, D64> d8;
  for (int r = 0; r < rows; ++r) {
    const int first = r * kCell_px, last = std::min(pixels.rows, first + kCell_px);
    std::fill_n(cells.row(cells.empty, r), words, ~std::uint64_t{0});
    for (int kind = 0; kind < 2; ++kind) {
      std::vector<std::uint64_t>& plane = kind ? pixels.object : pixels.empty;
      std::uint64_t* out = cells.row(kind ? cells.object : cells.empty, r);
      for (int w = 0; w < pixels.words; w += int(hn::Lanes(d))) {
        auto all = hn::Set(d, ~std::uint64_t{0});
        for (int v = first; v < last; ++v) all = hn::And(all, hn::LoadU(d, pixels.row(plane, v) + w));
        const auto full = hn::Eq(hn::BitCast(d8, all), hn::Set(d8, std::uint8_t(0xff)));
        hn::StoreMaskBits(d8, full, reinterpret_cast<std::uint8_t*>(out) + w);
      }
    }
  }
  return cells;
}

// Pixels and cells to bytes: the larger promise of both, negative where the pixel is an object pixel.
void distances(Planes& pixels, int used_words, std::int8_t* out, int stride) {
  constexpr int kPixelLevels = 7, kPixelBits = 4, kCellLevels = 14, kCellBits = 4;
  Planes cells = cells_of(pixels);
  const int cell_pitch = cells.words * 64 + 64;  // one vector more may be read
  std::vector<std::uint8_t> of_cells(std::size_t(cells.rows) * cell_pitch);
  const D8 d;
  spread<kCellLevels, kCellBits>(cells, [&](int r, const std::uint64_t* counts) {
    for (int w = 0; w < cells.words; ++w)
      bytes_from_bits<kCellBits>(counts + w, cells.words, [&](int part, auto steps) {  // n cells away: 8 (n - 1) + 1 px at least
        const auto px = hn::Add(hn::BitCast(d, hn::ShiftLeft<3>(hn::BitCast(hn::Repartition<std::uint16_t, D8>(), hn::Max(steps, hn::Set(d, std::uint8_t(1)))))), hn::Set(d, std::uint8_t(256 - 7)));
        hn::StoreU(hn::IfThenZeroElse(hn::Eq(steps, hn::Zero(d)), px), d, of_cells.data() + std::size_t(r) * cell_pitch + w * 64 + part);
      });
  });
  spread<kPixelLevels, kPixelBits>(pixels, [&](int r, const std::uint64_t* counts) {
    const std::uint8_t* cell_row = of_cells.data() + std::size_t(r / kCell_px) * cell_pitch;
    const std::uint64_t* object = pixels.row(pixels.object, r);
    const auto which = hn::ShiftRight<3>(hn::BitCast(hn::Repartition<std::uint16_t, D8>(), hn::Iota(d, 0)));
    // Pixel i of a vector belongs to cell i / 8; lookups stay within 16 bytes: the vector's cells are repeated in each.
    const auto cell_of = hn::And(hn::BitCast(d, which), hn::Set(d, std::uint8_t(7)));
    for (int w = 0; w < used_words; ++w)
      bytes_from_bits<kPixelBits>(counts + w, pixels.words, [&](int part, auto px) {
        const auto coarse = hn::TableLookupBytes(hn::LoadDup128(d, cell_row + w * 8 + part / 8), cell_of);
        const auto most = hn::Max(px, coarse);
        const auto inside = hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(object + w) + part / 8);
        hn::StoreU(hn::IfThenElse(inside, hn::Sub(hn::Zero(d), most), most), d, reinterpret_cast<std::uint8_t*>(out) + std::size_t(r) * stride + w * 64 + part);
      });
  });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace fivepipe
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fivepipe {
namespace {
HWY_EXPORT(distances);
}  // namespace

void BorderDistance::assign(const ObjectPixels& pixels) {
  bounds_ = pixels.bounds();
  stored_ = {};
  if (bounds_.empty()) return;
  const auto word_at_or_before = [](int u) { return (u >= 0 ? u : u - 63) / 64; };
  const int first_word = word_at_or_before(bounds_.u0_px - kMargin_px), last_word = word_at_or_before(bounds_.u1_px - 1 + kMargin_px);
  const int used_words = last_word - first_word + 1;
  const int words = kWordsPerStep * ((used_words + kWordsPerStep - 1) / kWordsPerStep);
  stored_ = {64 * first_word, bounds_.v0_px - kMargin_px, 64 * (last_word + 1), bounds_.v1_px + kMargin_px};
  Planes planes(stored_.height_px(), words);
  std::fill(planes.empty.begin(), planes.empty.end(), ~std::uint64_t{0});
  for (int v = bounds_.v0_px; v < bounds_.v1_px; ++v) {
    const std::uint64_t* from = pixels.words().data() + std::size_t(v) * pixels.words_per_row();
    std::uint64_t *object = planes.row(planes.object, v - stored_.v0_px), *empty = planes.row(planes.empty, v - stored_.v0_px);
    for (int w = std::max(first_word, 0); w <= std::min(last_word, pixels.words_per_row() - 1); ++w) {
      object[w - first_word] = from[w];
      empty[w - first_word] = ~from[w];
    }
  }
  stride_ = 64 * used_words;
  bytes_.resize(std::size_t(stride_) * planes.rows + 64);
  HWY_DYNAMIC_DISPATCH(distances)(planes, used_words, bytes_.data(), stride_);
}

int BorderDistance::anywhere(int u_px, int v_px) const {
  if (bounds_.empty()) return kMost_px;
  const int u = std::clamp(u_px, stored_.u0_px, stored_.u1_px - 1), v = std::clamp(v_px, stored_.v0_px, stored_.v1_px - 1);
  const int beyond = std::max(std::abs(u_px - u), std::abs(v_px - v));
  return beyond > 0 ? beyond + kMargin_px : at(u, v);
}

}  // namespace fivepipe
#endif
