#include "common/hull/coverage/sparse_coverage.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace fivepipe::hull {

SparseCoverageMap::SparseCoverageMap(ObjectPixels object, CoverageOutline outline)
    : object_(std::move(object)),
      outline_(std::move(outline)),
      first_(outline_.pixels.words().size()) {
  assert(outline_.pixels.width_px() == object_.width_px() &&
         outline_.pixels.height_px() == object_.height_px());
  std::uint32_t first = 0;
  const std::span<const std::uint64_t> words = outline_.pixels.words();
  for (std::size_t i = 0; i < words.size(); ++i)
    if (words[i]) {
      first_[i] = first;
      first += std::uint32_t(std::popcount(words[i]));
    }
  assert(first == outline_.coverage.size());
}

static ObjectPixels at_least_half(const CoverageMap& map) {
  ObjectPixels half(map.width_px(), map.height_px());
  for (int v = 0; v < map.height_px(); ++v)
    for (int u = 0; u < map.width_px(); ++u)
      if (side_of_border(map.at(u, v)) > 0) half.set(u, v);
  return half;
}

SparseCoverageMap::SparseCoverageMap(const CoverageMap& map) {
  ObjectPixels half = at_least_half(map);
  CoverageOutline outline = map.outline(half);
  *this = SparseCoverageMap(std::move(half), std::move(outline));
}

double SparseCoverageMap::interpolated(double u_px, double v_px) const {
  if (!object_.holds(u_px, v_px)) return 0;
  const int u = int(std::floor(u_px)), v = int(std::floor(v_px));
  const double du = u_px - u, dv = v_px - v;
  const int u0 = std::max(u, 0), u1 = std::min(u + 1, width_px() - 1), v0 = std::max(v, 0),
            v1 = std::min(v + 1, height_px() - 1);
  const double above = at(u0, v0) * (1 - du) + at(u1, v0) * du,
               below = at(u0, v1) * (1 - du) + at(u1, v1) * du;
  return (above * (1 - dv) + below * dv) / kFullCoverage;
}

ObjectPixels SparseCoverageMap::half_covered() const {
  ObjectPixels half = object_;
  const std::span<const std::uint64_t> words = outline_.pixels.words();
  auto coverage = outline_.coverage.begin();
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::uint64_t& here = half.mutable_words()[i];
    for (std::uint64_t left = words[i]; left; left &= left - 1) {
      const std::uint64_t bit = left & -left;
      here = side_of_border(*coverage++) > 0 ? here | bit : here & ~bit;
    }
  }
  return half;
}

std::vector<std::uint8_t> SparseCoverageMap::bytes(const PixelRect& rect) const {
  std::vector<std::uint8_t> bytes(rect.area_px());
  if (bytes.empty()) return bytes;
  const auto pixel = [&](int u, int v) {
    return bytes.begin() + std::ptrdiff_t(v - rect.v0_px) * rect.width_px() + (u - rect.u0_px);
  };
  object_.for_each_run(rect, [&](int v, int u, int end) {
    std::fill(pixel(u, v), pixel(u, v) + (end - u), std::uint8_t(kFullCoverage));
  });
  outline_.pixels.for_each_run(rect, [&](int v, int u, int end) {
    for (; u < end; ++u) *pixel(u, v) = at(u, v);
  });
  return bytes;
}

CoverageMap SparseCoverageMap::dense() const {
  return CoverageMap::from_bytes(width_px(), height_px(), bytes({0, 0, width_px(), height_px()}));
}

}  // namespace fivepipe::hull
