// A coverage map that stores its outline: what queries of the hull read.
#pragma once
#include <bit>

#include "common/hull/coverage/coverage_map.h"

namespace fivepipe::hull {

// The object pixels of an image and the coverage of the pixels at their outline. Most pixels are
// covered wholly or not at all, so it has about a third of the bytes of a CoverageMap.
class SparseCoverageMap {
 public:
  SparseCoverageMap() = default;
  // The outline has the image's size and one byte per pixel (asserted).
  SparseCoverageMap(ObjectPixels object, CoverageOutline outline);
  SparseCoverageMap(const CoverageMap& map);  // implicit: the same coverage

  int width_px() const { return object_.width_px(); }
  int height_px() const { return object_.height_px(); }
  // The pixel is inside the image.
  std::uint8_t at(int u_px, int v_px) const {
    const std::size_t word =
        std::size_t(v_px) * std::size_t(object_.words_per_row()) + std::size_t(u_px >> 6);
    const std::uint64_t bit = std::uint64_t(1) << (u_px & 63),
                        outline = outline_.pixels.words()[word];
    if (!(outline & bit)) return object_.words()[word] & bit ? kFullCoverage : 0;
    return outline_.coverage[first_[word] + std::size_t(std::popcount(outline & (bit - 1)))];
  }
  // Interpolates bilinearly between pixel centres, clamped beyond the outermost ones. Returns a
  // fraction, or 0 outside the image and for NaN.
  double interpolated(double u_px, double v_px) const;
  // Returns the pixels at or above one half.
  ObjectPixels half_covered() const;
  // Coverage of the pixels of a rectangle inside the image, row by row.
  std::vector<std::uint8_t> bytes(const PixelRect& rect) const;
  CoverageMap dense() const;

  const ObjectPixels& object() const { return object_; }
  const CoverageOutline& outline() const { return outline_; }

 private:
  ObjectPixels object_;
  CoverageOutline outline_;
  // Index of the first outline pixel of each word of outline_.pixels in outline_.coverage; 0 for
  // a word without any.
  std::vector<std::uint32_t> first_;
};

// One camera and its coverage map, which has the size of the camera's image.
struct CoverageSilhouette {
  geometry::Camera camera;
  SparseCoverageMap map;
};

}  // namespace fivepipe::hull
