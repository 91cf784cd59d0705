#include "common/hull/coverage/coverage_map.h"

#include <algorithm>
#include <cassert>

namespace fivepipe::hull {
namespace {

// Points per pixel: a Fibonacci lattice (Sloan and Joe, Lattice Methods, 1994). Each of its points
// has its own row and column, so the coverage of an axis-parallel edge is exact to 1/233; 16 x 16
// points would give 1/16.
constexpr int kLatticePoints = 233, kLatticeStep = 144;

// The silhouette of a capsule is convex, so it holds a pixel if it holds the pixel's corners.
bool covers_whole_pixel(const Capsule& capsule, const geometry::Camera& camera, int u, int v) {
  for (const double du : {-0.5, 0.5})
    for (const double dv : {-0.5, 0.5})
      if (!in_silhouette({&capsule, 1}, camera, {u + du, v + dv})) return false;
  return true;
}

std::uint8_t counted_coverage(std::span<const Capsule> object, const geometry::Camera& camera,
                              int u, int v) {
  int in = 0;
  for (int i = 0; i < kLatticePoints; ++i) {
    const double du = (i + 0.5) / kLatticePoints - 0.5,
                 dv = (i * kLatticeStep % kLatticePoints + 0.5) / kLatticePoints - 0.5;
    in += in_silhouette(object, camera, {u + du, v + dv});
  }
  return std::uint8_t((in * kFullCoverage + kLatticePoints / 2) / kLatticePoints);
}

}  // namespace

CoverageMap::CoverageMap(int width_px, int height_px)
    : width_px_(width_px),
      height_px_(height_px),
      bytes_(std::size_t(width_px) * std::size_t(height_px)) {}

CoverageMap CoverageMap::from_bytes(int width_px, int height_px,
                                    std::span<const std::uint8_t> bytes) {
  CoverageMap map(width_px, height_px);
  assert(bytes.size() == map.bytes_.size());
  std::copy(bytes.begin(), bytes.end(), map.bytes_.begin());
  return map;
}

CoverageMap CoverageMap::from_pixels(const ObjectPixels& pixels) {
  return from_bytes(pixels.width_px(), pixels.height_px(), pixels.to_bytes());
}

void CoverageMap::keep(const ObjectPixels& pixels) {
  const std::vector<std::uint8_t> kept = pixels.to_bytes();
  for (std::size_t i = 0; i < bytes_.size(); ++i) bytes_[i] &= kept[i];
}

CoverageOutline CoverageMap::outline(const ObjectPixels& object) const {
  assert(object.width_px() == width_px_ && object.height_px() == height_px_);
  CoverageOutline outline{ObjectPixels(width_px_, height_px_), {}};
  const std::vector<std::uint8_t> binary = object.to_bytes();
  const auto first = bytes_.begin();
  for (int v = 0; v < height_px_; ++v) {
    const std::ptrdiff_t begin = std::ptrdiff_t(v) * width_px_, end = begin + width_px_;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      i = std::mismatch(first + i, first + end, binary.begin() + i).first - first;
      if (i == end) break;
      outline.pixels.set(int(i - begin), v);
      outline.coverage.push_back(bytes_[std::size_t(i)]);
    }
  }
  return outline;
}

void CoverageMap::set(int u_px, int v_px, std::uint8_t coverage) {
  bytes_[std::size_t(v_px) * std::size_t(width_px_) + std::size_t(u_px)] = coverage;
}

CoverageMap true_coverage(std::span<const Capsule> object, const geometry::Camera& camera) {
  const ObjectPixels touched = true_object_pixels(object, camera, PixelRule::touched);
  CoverageMap map(touched.width_px(), touched.height_px());
  const PixelRect bounds = touched.bounds();
  for (int v = bounds.v0_px; v < bounds.v1_px; ++v)
    for (int u = bounds.u0_px; u < bounds.u1_px; ++u) {
      if (!touched.contains(u, v)) continue;
      const bool whole = std::any_of(object.begin(), object.end(), [&](const Capsule& c) {
        return covers_whole_pixel(c, camera, u, v);
      });
      map.set(u, v, whole ? std::uint8_t(kFullCoverage) : counted_coverage(object, camera, u, v));
    }
  return map;
}

}  // namespace fivepipe::hull
