// The object pixels of one camera image: the pixels that a newly introduced real object covers
// (paper, section 3.1).
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fivepipe::hull {

// Half-open rectangle of pixels [u0, u1) x [v0, v1). It is empty if u0 >= u1 or v0 >= v1.
struct PixelRect {
  int u0_px = 0, v0_px = 0, u1_px = 0, v1_px = 0;
  int width_px() const { return u1_px > u0_px ? u1_px - u0_px : 0; }
  int height_px() const { return v1_px > v0_px ? v1_px - v0_px : 0; }
  bool empty() const { return width_px() == 0 || height_px() == 0; }
  std::size_t area_px() const { return std::size_t(width_px()) * std::size_t(height_px()); }
  bool operator==(const PixelRect&) const = default;
};

// Returns the pixels that are in both rectangles; empty() if there is none.
PixelRect intersection(const PixelRect& a, const PixelRect& b);

// Bit map of a whole image. Pixel (u, v) is bit u % 64 of word v * words_per_row() + u / 64.
// Invariant: bits beyond the width are zero, so rows can be compared and counted word by word.
class ObjectPixels {
 public:
  ObjectPixels() = default;
  ObjectPixels(int width_px, int height_px);  // no object pixel; sizes >= 0

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  int words_per_row() const { return words_per_row_; }

  bool contains(int u_px, int v_px) const {  // false outside the image
    return u_px >= 0 && v_px >= 0 && u_px < width_px_ && v_px < height_px_ &&
           (words_[std::size_t(v_px) * words_per_row_ + (u_px >> 6)] >> (u_px & 63) & 1);
  }
  // Returns true if uv is in the image, which is the union of the half-open squares
  // [u - 0.5, u + 0.5) x [v - 0.5, v + 0.5) of its pixels. Returns false for NaN.
  bool holds(double u_px, double v_px) const {
    return u_px >= -0.5 && v_px >= -0.5 && u_px < width_px_ - 0.5 && v_px < height_px_ - 0.5;
  }
  // Returns true if the pixel whose square holds uv is an object pixel.
  bool contains_at(double u_px, double v_px) const {
    return holds(u_px, v_px) &&
           contains(int(u_px + 0.5), int(v_px + 0.5));  // not negative, so truncation is floor
  }
  void set(int u_px, int v_px, bool object = true);  // the pixel is inside the image
  void set_run(int u_px, int end_px, int v_px);      // sets [u, end) of row v, inside the image
  // The following need `others` of the same size.
  void add(const ObjectPixels& others);     // sets their object pixels
  void remove(const ObjectPixels& others);  // clears their object pixels
  void keep(const ObjectPixels& others);    // clears the pixels that are not their object pixels
  // Returns the first pixel of row v in [u, end) whose value is `object`, or end if there is none.
  int find(int u_px, int end_px, int v_px, bool object) const;

  std::span<const std::uint64_t> words() const { return words_; }
  // For bulk writers, which must keep the invariant.
  std::span<std::uint64_t> mutable_words() { return words_; }

  std::size_t count() const;
  // Number of object pixels that are also object pixels of `others`, which has the same size.
  std::size_t count_common(const ObjectPixels& others) const;
  PixelRect bounds() const;                    // smallest rectangle that holds every object pixel
  std::vector<std::uint8_t> to_bytes() const;  // 0 or 255, row-major

  bool operator==(const ObjectPixels&) const = default;

  // Calls f(v, begin, end) for each run of object pixels in `region`, row by row. The region is
  // inside the image.
  template <class F>
  void for_each_run(const PixelRect& region, F f) const {
    for (int v = region.v0_px; v < region.v1_px; ++v)
      for (int begin = find(region.u0_px, region.u1_px, v, true), end; begin < region.u1_px;
           begin = find(end, region.u1_px, v, true)) {
        end = find(begin, region.u1_px, v, false);
        f(v, begin, end);
      }
  }

 private:
  int width_px_ = 0, height_px_ = 0, words_per_row_ = 0;
  std::vector<std::uint64_t> words_;
};

}  // namespace fivepipe::hull
