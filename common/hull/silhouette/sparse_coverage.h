// A coverage map in the memory of its outline: what queries of the hull read.
#pragma once
#include <bit>
#include <optional>

#include "common/hull/silhouette/coverage.h"

namespace fivepipe::hull {

// The object pixels of an image and the coverage of the pixels at their outline. Most pixels are
// covered wholly or not at all, so it has an eighth of the bytes of a CoverageMap.
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
  // Index of the first outline pixel of each word of outline_.pixels in outline_.coverage; not
  // initialised where the word is zero.
  std::vector<std::uint32_t> first_;
};

// One camera and its coverage map, which has the size of the camera's image.
struct CoverageSilhouette {
  geometry::Camera camera;
  SparseCoverageMap map;
};

// Standard deviation of the Gaussian weights with which a plane is fitted to the coverage, and half
// the size of the window [px]. On large spheres and capsules the normals have an error of 0.2 to
// 0.4 degrees. With 0.7 px it is 1 degree because of the sampling grid; with 1.5 px it is 0.1
// degrees, but on objects 3 px thin it grows from 4 to 10 degrees, because the window includes
// their other side.
inline constexpr double kNormalSigma_px = 1.0;
inline constexpr int kNormalWindow_px = 3;
// A plane whose slope is at most this has no direction, because the slope is within the rounding of
// 8 bits [1/255 per px].
inline constexpr double kMinFall = 1.0;

// Returns the unit vector in the image that points out of the silhouette at a border point: the
// downhill direction of the plane fitted to the coverage around it. Returns nullopt if that slope
// is at most kMinFall or uv is outside the image.
std::optional<Eigen::Vector2d> outward_in_image(const SparseCoverageMap& map,
                                                const Eigen::Vector2d& uv_px);

}  // namespace fivepipe::hull
