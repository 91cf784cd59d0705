// Sub-pixel silhouettes: the fraction of each pixel that the object covers, as 8 bits. The border
// is the level set one half of the bilinear interpolation between pixel centres.
//
// Sources: marching squares (Lorensen and Cline, 1987, in two dimensions), with the interpolant's
// hyperbolas in place of chords (asymptotic decider: Nielson and Hamann, 1991).
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/coverage/coverage_outline.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::hull {

// Full coverage. side_of_border() is > 0 inside and < 0 outside; it is odd, so that no pixel centre
// is on the border.
inline constexpr int kFullCoverage = 255;
constexpr int side_of_border(std::uint8_t coverage) { return 2 * coverage - kFullCoverage; }

// Coverage of every pixel of an image: 0 is none, 255 is all of its unit square.
class CoverageMap {
 public:
  CoverageMap() = default;
  CoverageMap(int width_px, int height_px);  // coverage 0 everywhere; sizes >= 0
  // Copies a map. Rows are top to bottom without padding; bytes.size() == width * height.
  static CoverageMap from_bytes(int width_px, int height_px, std::span<const std::uint8_t> bytes);
  static CoverageMap from_pixels(const ObjectPixels& pixels);  // 0 or 255

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  // The pixel is inside the image.
  std::uint8_t at(int u_px, int v_px) const {
    return bytes_[std::size_t(v_px) * std::size_t(width_px_) + std::size_t(u_px)];
  }
  void set(int u_px, int v_px, std::uint8_t coverage);  // the pixel is inside the image
  // Sets the coverage of all pixels that are not in `pixels`, which has the same size, to 0.
  void keep(const ObjectPixels& pixels);
  std::span<const std::uint8_t> bytes() const { return bytes_; }

  // Returns the pixels whose coverage differs from that of `object` (0 or 255), which has the
  // image's size (asserted).
  CoverageOutline outline(const ObjectPixels& object) const;

  bool operator==(const CoverageMap&) const = default;

 private:
  int width_px_ = 0, height_px_ = 0;
  std::vector<std::uint8_t> bytes_;
};

// Returns the true coverage of an analytic object. It is exactly 255 if one capsule alone covers
// the pixel and 0 if none touches it. Otherwise it is counted on a lattice of 233 points per pixel,
// within 0.02 of the true area.
CoverageMap true_coverage(std::span<const Capsule> object, const geometry::Camera& camera);

}  // namespace fivepipe::hull
