// Sub-pixel silhouettes: how much of each pixel the object covers, 8 bit, and the border at one
// half of it by bilinear interpolation between pixel centres.
//
// Sources: the level line of interpolated samples is marching squares' (Lorensen and Cline 1987, in
// two dimensions), with the interpolant's own hyperbolas in place of chords (asymptotic decider:
// Nielson and Hamann 1991).
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/hull/oracle/analytic.h"

namespace fivepipe::hull {

// Twice a coverage less this is its side of the border: odd, so that no pixel centre is ever on the
// border itself.
inline constexpr int kFullCoverage = 255;
constexpr int side_of_border(std::uint8_t coverage) { return 2 * coverage - kFullCoverage; }

// Coverage of every pixel of an image: 0 none, 255 all of its unit square.
class CoverageMap {
 public:
  CoverageMap() = default;
  CoverageMap(int width_px, int height_px);  // nothing covered; sizes >= 0
  // Row-major without padding; bytes.size() == width * height.
  static CoverageMap from_bytes(int width_px, int height_px, std::span<const std::uint8_t> bytes);
  static CoverageMap from_pixels(const ObjectPixels& pixels);  // 0 or 255

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  std::uint8_t at(int u_px, int v_px) const {
    return bytes_[std::size_t(v_px) * std::size_t(width_px_) + std::size_t(u_px)];
  }  // inside the image
  std::uint8_t at_nearest(int u_px,
                          int v_px) const;  // of the nearest pixel in the image, which has one
  void set(int u_px, int v_px, std::uint8_t coverage);  // inside the image
  std::span<const std::uint8_t> bytes() const { return bytes_; }

  // Bilinear between pixel centres, clamped beyond the outermost, as a fraction; 0 outside the
  // image and for NaN.
  double interpolated(double u_px, double v_px) const;

  bool operator==(const CoverageMap&) const = default;

 private:
  int width_px_ = 0, height_px_ = 0;
  std::vector<std::uint8_t> bytes_;
};

// One camera's evidence; the map has the size of its pinhole's image.
struct CoverageSilhouette {
  geometry::Camera camera;
  CoverageMap map;
};

// True coverage of an analytic object. Pixels that one capsule covers alone are 255 exactly,
// untouched ones 0; the rest is counted on a lattice of 233 points per pixel: within 0.02 of the
// true area.
CoverageMap true_coverage(std::span<const Capsule> object, const geometry::Camera& camera);

// Standard deviation of the Gaussian weights in which a plane is fitted to the coverage, and how
// far the window reaches [px]. Measured on spheres and capsules: 0.7 leaves a degree of the
// samples' grid in the normals of large things (1.0: 0.2 to 0.4 degrees); 1.5 has 0.1, but mixes in
// the other side of things 3 px thin (10 degrees instead of 4).
inline constexpr double kNormalSigma_px = 1.0;
inline constexpr int kNormalReach_px = 3;
// A plane that falls by less than this across a pixel has no direction [coverage of 255]: the
// rounding of 8 bits.
inline constexpr double kMinFall = 1.0;

// Unit vector in the image that points out of the silhouette at a border point: down the plane
// fitted to the coverage around it. Nothing where the coverage is nearly the same all around, or uv
// is outside the image.
std::optional<Eigen::Vector2d> outward_in_image(const CoverageMap& map,
                                                const Eigen::Vector2d& uv_px);

}  // namespace fivepipe::hull
