// The size of the uniform box ahead of each pixel of a map: the empty-space skipping structure of
// the CPU's queries.
//
// It is computed by erosion of bit planes, 64 pixels per word: a box of side a + b is the union of
// four boxes of side a that are b apart (decomposition of structuring elements, van den Boomgaard
// and van Balen, 1992).
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// The side of a pixel on which its box is. The pixel is the corner of the box; a point that moves
// in that direction enters the box there.
enum class Quadrant { right_down, left_down, right_up, left_up };
inline constexpr int kQuadrants = 4;
constexpr Quadrant quadrant_ahead(bool left, bool up) { return Quadrant(int(left) + 2 * int(up)); }
// Returns the box of `extent` x `extent` pixels at pixel (u, v).
inline PixelRect quadrant_rect(Quadrant box, int u, int v, int extent) {
  const bool left = box == Quadrant::left_down || box == Quadrant::left_up,
             up = box == Quadrant::right_up || box == Quadrant::left_up;
  return {left ? u - extent + 1 : u, up ? v - extent + 1 : v, left ? u + 1 : u + extent,
          up ? v + 1 : v + extent};
}

// The extents that the map stores [px]; other extents are rounded down to a stored one. Each is at
// most twice the one before. Twice as many extents save 10 % of a ray's steps and double the time
// to create them.
inline constexpr std::array<int, 8> kExtents_px = {1, 2, 3, 5, 9, 17, 33, 65};

class SkipMap {
 public:
  // The stored region extends at least this far beyond the object pixels [px].
  static constexpr int kMargin_px = 8;

  // Copies the bits around the object and reuses the memory. Creates no quadrant.
  void assign(const ObjectPixels& pixels);
  // Creates a quadrant. Call at most once for each; different quadrants may be created
  // concurrently.
  void make(Quadrant box);
  bool has(Quadrant box) const { return made_[std::size_t(box)]; }

  const PixelRect& bounds() const { return bounds_; }  // bounds of the object pixels
  // The stored region: the bounds and a margin, which may extend beyond the image. Empty if there
  // is no object pixel.
  const PixelRect& stored() const { return stored_; }

  // Returns r > 0 if no pixel of the box with extent r is an object pixel, r < 0 if all pixels of
  // the box with extent -r are. There are no object pixels outside the image. Requires has(box).
  int at(Quadrant box, int u_px, int v_px) const {
    if (bounds_.empty()) return kExtents_px.back();
    const int u = std::clamp(u_px, stored_.u0_px, stored_.u1_px - 1),
              v = std::clamp(v_px, stored_.v0_px, stored_.v1_px - 1);
    if (const int beyond = std::max(std::abs(u_px - u), std::abs(v_px - v)))
      return beyond + kMargin_px;
    return bytes(box)[std::ptrdiff_t(v - stored_.v0_px) * stride_ + (u - stored_.u0_px)];
  }
  // Returns at() of the pixels of stored(), row by row, `stride` bytes apart. Up to three bytes
  // after the last row are readable.
  const std::int8_t* bytes(Quadrant box) const {
    return bytes_.get() + std::size_t(box) * box_bytes_;
  }
  int stride() const { return stride_; }
  std::size_t box_bytes() const {
    return box_bytes_;
  }  // distance between the bytes of two quadrants

 private:
  PixelRect bounds_, stored_;
  int stride_ = 0, words_ = 0;  // words_ per row of the bit planes, rounded up to whole vectors
  std::size_t box_bytes_ = 0, bytes_size_ = 0;
  std::vector<std::uint64_t> empty_, object_;  // bit planes of `stored`
  std::unique_ptr<std::int8_t[]>
      bytes_;  // of each quadrant that exists; the rest is not initialised
  std::array<bool, kQuadrants> made_{};
};

}  // namespace fivepipe::hull
