#include "common/hull/object_pixels.h"

#include <algorithm>
#include <cassert>

namespace fivepipe::hull {
namespace {

// Most words of a map are zero. Without the instruction for it, std::popcount is a function call.
std::size_t ones(std::uint64_t word) { return word == 0 ? 0 : std::size_t(std::popcount(word)); }

}  // namespace

PixelRect intersection(const PixelRect& a, const PixelRect& b) {
  return {std::max(a.u0_px, b.u0_px), std::max(a.v0_px, b.v0_px), std::min(a.u1_px, b.u1_px),
          std::min(a.v1_px, b.v1_px)};
}

ObjectPixels::ObjectPixels(int width_px, int height_px)
    : width_px_(width_px),
      height_px_(height_px),
      words_per_row_((width_px + 63) / 64),
      words_(std::size_t(words_per_row_) * height_px) {
  assert(width_px >= 0 && height_px >= 0);
}

void ObjectPixels::set(int u_px, int v_px, bool object) {
  assert(u_px >= 0 && v_px >= 0 && u_px < width_px_ && v_px < height_px_);
  std::uint64_t& word = words_[std::size_t(v_px) * words_per_row_ + (u_px >> 6)];
  const std::uint64_t bit = std::uint64_t(1) << (u_px & 63);
  word = object ? word | bit : word & ~bit;
}

void ObjectPixels::set_run(int u_px, int end_px, int v_px) {
  assert(u_px >= 0 && u_px <= end_px && end_px <= width_px_ && v_px >= 0 && v_px < height_px_);
  std::uint64_t* row = words_.data() + std::size_t(v_px) * std::size_t(words_per_row_);
  for (int u = u_px; u < end_px;) {
    const int stop = std::min(end_px, (u | 63) + 1);
    const std::uint64_t run =
        stop - u == 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << (stop - u)) - 1;
    row[std::size_t(u) >> 6] |= run << (u & 63);
    u = stop;
  }
}

void ObjectPixels::add(const ObjectPixels& others) {
  assert(others.width_px_ == width_px_ && others.height_px_ == height_px_);
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] |= others.words_[i];
}

void ObjectPixels::remove(const ObjectPixels& others) {
  assert(others.width_px_ == width_px_ && others.height_px_ == height_px_);
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= ~others.words_[i];
}

void ObjectPixels::keep(const ObjectPixels& others) {
  assert(others.width_px_ == width_px_ && others.height_px_ == height_px_);
  for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= others.words_[i];
}

int ObjectPixels::find(int u_px, int end_px, int v_px, bool object) const {
  const std::uint64_t* row = words_.data() + std::size_t(v_px) * std::size_t(words_per_row_);
  for (int u = u_px; u < end_px; u = (u | 63) + 1) {
    const std::uint64_t word =
        (object ? row[std::size_t(u) >> 6] : ~row[std::size_t(u) >> 6]) >> (u & 63);
    if (word) return std::min(end_px, u + std::countr_zero(word));
  }
  return end_px;
}

std::size_t ObjectPixels::count() const {
  std::size_t n = 0;
  for (const std::uint64_t word : words_) n += ones(word);
  return n;
}

std::size_t ObjectPixels::count_common(const ObjectPixels& others) const {
  assert(others.width_px_ == width_px_ && others.height_px_ == height_px_);
  std::size_t n = 0;
  for (std::size_t i = 0; i < words_.size(); ++i) n += ones(words_[i] & others.words_[i]);
  return n;
}

PixelRect ObjectPixels::bounds() const {
  // ORs all rows together, kStep columns of words at a time, so that the words stay in registers.
  constexpr int kStep = 4;
  std::vector<std::uint64_t> columns(std::size_t(words_per_row_), 0);
  for (int first = 0; first < words_per_row_; first += kStep) {
    const int count = std::min(kStep, words_per_row_ - first);
    const std::uint64_t* from = words_.data() + first;
    if (count == kStep) {
      std::uint64_t any[kStep] = {};
      for (int v = 0; v < height_px_; ++v, from += words_per_row_)
        for (int w = 0; w < kStep; ++w) any[w] |= from[w];
      std::copy(any, any + kStep, columns.begin() + first);
    } else {
      for (int v = 0; v < height_px_; ++v, from += words_per_row_)
        for (int w = 0; w < count; ++w) columns[std::size_t(first + w)] |= from[w];
    }
  }
  const auto row_is_empty = [&](int v) {
    const auto row = words_.begin() + std::ptrdiff_t(v) * words_per_row_;
    return std::all_of(row, row + words_per_row_, [](std::uint64_t word) { return word == 0; });
  };
  int v0 = 0, v1 = height_px_;
  while (v0 < v1 && row_is_empty(v0)) ++v0;
  while (v1 > v0 && row_is_empty(v1 - 1)) --v1;
  if (v0 >= v1) return {};
  int first = 0, last = words_per_row_ - 1;
  while (!columns[first]) ++first;
  while (!columns[last]) --last;
  return {first * 64 + std::countr_zero(columns[first]), v0,
          last * 64 + 64 - std::countl_zero(columns[last]), v1};
}

std::vector<std::uint8_t> ObjectPixels::to_bytes() const {
  std::vector<std::uint8_t> mask(std::size_t(width_px_) * height_px_);
  for_each_run(bounds(), [&](int v, int begin, int end) {
    std::fill_n(mask.begin() + std::ptrdiff_t(v) * width_px_ + begin, end - begin,
                std::uint8_t(255));
  });
  return mask;
}

}  // namespace fivepipe::hull
