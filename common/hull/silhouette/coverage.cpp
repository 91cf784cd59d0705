#include "common/hull/silhouette/coverage.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace fivepipe::hull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

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

CoverageMap CoverageMap::from_outline(const ObjectPixels& object, const CoverageOutline& outline) {
  assert(outline.pixels.width_px() == object.width_px() &&
         outline.pixels.height_px() == object.height_px());
  CoverageMap map = from_pixels(object);
  auto next = outline.coverage.begin();
  outline.pixels.for_each_run(outline.pixels.bounds(), [&](int v, int u, int end) {
    std::copy(next, next + (end - u), map.bytes_.begin() + std::ptrdiff_t(v) * map.width_px_ + u);
    next += end - u;
  });
  return map;
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

std::uint8_t CoverageMap::at_nearest(int u_px, int v_px) const {
  return at(std::clamp(u_px, 0, width_px_ - 1), std::clamp(v_px, 0, height_px_ - 1));
}

void CoverageMap::set(int u_px, int v_px, std::uint8_t coverage) {
  bytes_[std::size_t(v_px) * std::size_t(width_px_) + std::size_t(u_px)] = coverage;
}

double CoverageMap::interpolated(double u_px, double v_px) const {
  if (!(u_px >= -0.5 && v_px >= -0.5 && u_px < width_px_ - 0.5 && v_px < height_px_ - 0.5))
    return 0;
  const int u = int(std::floor(u_px)), v = int(std::floor(v_px));
  const double du = u_px - u, dv = v_px - v;
  const double above = at_nearest(u, v) * (1 - du) + at_nearest(u + 1, v) * du,
               below = at_nearest(u, v + 1) * (1 - du) + at_nearest(u + 1, v + 1) * du;
  return (above * (1 - dv) + below * dv) / kFullCoverage;
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

std::optional<Vector2d> outward_in_image(const CoverageMap& map, const Vector2d& uv_px) {
  if (!(uv_px.x() >= -0.5 && uv_px.y() >= -0.5 && uv_px.x() < map.width_px() - 0.5 &&
        uv_px.y() < map.height_px() - 0.5))
    return std::nullopt;
  // Least squares of coverage = a + g . (pixel - uv), weighted; g follows from the 3 x 3 normal
  // equations.
  const int u0 = int(std::lround(uv_px.x())) - kNormalWindow_px,
            v0 = int(std::lround(uv_px.y())) - kNormalWindow_px;
  constexpr int kSide = 2 * kNormalWindow_px + 1;
  std::array<double, kSide> weight_u, weight_v;
  const auto weight = [](double d) {
    return std::exp(-0.5 * d * d / (kNormalSigma_px * kNormalSigma_px));
  };
  for (int i = 0; i < kSide; ++i) {
    weight_u[i] = weight(u0 + i - uv_px.x());
    weight_v[i] = weight(v0 + i - uv_px.y());
  }
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Vector3d right_side = Vector3d::Zero();
  for (int v = std::max(v0, 0); v < std::min(v0 + kSide, map.height_px()); ++v)
    for (int u = std::max(u0, 0); u < std::min(u0 + kSide, map.width_px()); ++u) {
      const Vector3d row(1, u - uv_px.x(), v - uv_px.y());
      const Vector3d weighted = weight_u[u - u0] * weight_v[v - v0] * row;
      normal_matrix += weighted * row.transpose();
      right_side += map.at(u, v) * weighted;
    }
  const Vector2d gradient = normal_matrix.ldlt().solve(right_side).tail<2>();
  const double length = gradient.norm();
  if (!(length > kMinFall)) return std::nullopt;
  return -gradient / length;
}

}  // namespace fivepipe::hull
