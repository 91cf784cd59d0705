// How far boxes of like pixels extend ahead of the pixels of a map: the skipping structure of the
// CPU's volume queries.
//
// Made by erosion of bit planes, one word 64 pixels: a box of side a + b is four boxes of side a, b
// apart (decomposition of structuring elements, van den Boomgaard and van Balen, 1992). What else
// was measured: docs/hull.md.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// On which side of a pixel its box lies, with the pixel in the corner: where a point that moves so
// is going.
enum class Quadrant { right_down, left_down, right_up, left_up };
inline constexpr int kQuadrants = 4;
constexpr Quadrant quadrant_ahead(bool left, bool up) { return Quadrant(int(left) + 2 * int(up)); }
// The `extent` x `extent` pixels.
inline PixelRect quadrant_rect(Quadrant box, int u, int v, int extent) {
  const bool left = box == Quadrant::left_down || box == Quadrant::left_up,
             up = box == Quadrant::right_up || box == Quadrant::left_up;
  return {left ? u - extent + 1 : u, up ? v - extent + 1 : v, left ? u + 1 : u + extent,
          up ? v + 1 : v + extent};
}

// The reaches that are told apart [px]; what lies between counts as the next below. Each is at most
// twice the one before. Twice as many save a tenth of a ray's steps and cost twice the making.
inline constexpr std::array<int, 8> kExtents_px = {1, 2, 3, 5, 9, 17, 33, 65};

class SkipMap {
 public:
  // The region in store reaches at least so far beyond the object pixels [px].
  static constexpr int kMargin_px = 8;

  // Takes a copy of the bits around the object; reuses the memory. No box is made yet.
  void assign(const ObjectPixels& pixels);
  void make(Quadrant box);  // once; different ones may be made at the same time
  bool has(Quadrant box) const { return made_[std::size_t(box)]; }
  void make_all();

  const PixelRect& bounds() const { return bounds_; }  // of the object pixels
  // What is in store: bounds and margin; parts may lie outside the image. Empty without object
  // pixels.
  const PixelRect& stored() const { return stored_; }

  // r > 0: no pixel of the box with extent r is an object pixel. r < 0: all of that with extent -r
  // are; outside the image there is none. The box has been made.
  int at(Quadrant box, int u_px, int v_px) const {
    if (bounds_.empty()) return kExtents_px.back();
    const int u = std::clamp(u_px, stored_.u0_px, stored_.u1_px - 1),
              v = std::clamp(v_px, stored_.v0_px, stored_.v1_px - 1);
    if (const int beyond = std::max(std::abs(u_px - u), std::abs(v_px - v)))
      return beyond + kMargin_px;
    return bytes(box)[std::ptrdiff_t(v - stored_.v0_px) * stride_ + (u - stored_.u0_px)];
  }
  // The same of all four boxes together: r > 0: no pixel less than r columns and rows away is an
  // object pixel. All have been made.
  int min_extent(int u_px, int v_px) const;

  // Of stored's pixels, row by row; three more bytes may be read after the last row.
  const std::int8_t* bytes(Quadrant box) const {
    return bytes_.get() + std::size_t(box) * box_bytes_;
  }
  int stride() const { return stride_; }
  std::size_t box_bytes() const { return box_bytes_; }  // from one box's bytes to the next's

 private:
  PixelRect bounds_, stored_;
  int stride_ = 0, words_ = 0;  // of the bit planes, rounded up to whole vectors
  std::size_t box_bytes_ = 0, bytes_size_ = 0;
  std::vector<std::uint64_t> empty_, object_;  // bit planes of `stored`
  std::unique_ptr<std::int8_t[]> bytes_;  // of each box that was made; the rest is never touched
  std::array<bool, kQuadrants> made_{};
};

}  // namespace fivepipe::hull
