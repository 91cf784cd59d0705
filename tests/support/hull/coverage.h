// The hull of coverage maps and its definition, sampled densely along rays.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/hull/coverage/coverage_hull.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/hull/test_pool.h"

namespace fivepipe::hull {

inline constexpr int kSamples = 4000;     // samples of the definition per ray
inline constexpr double kAgree_m = 1e-6;  // a float near 1 m has a unit of 6e-8 m
// Error of the coverage at a border whose depth is a float: 2e-7 m times 1000 px per metre (the
// finest map here) times 1 per px.
inline constexpr double kOnBorder = 1e-3;
inline constexpr double kNearestSample_m = 1e-9;

inline DepthTile depth_of(std::span<const CoverageSilhouette> silhouettes, const View& view) {
  return CoverageHull(test::test_pool(), {silhouettes.begin(), silhouettes.end()})
      .depth(view, test::whole_image(view.camera));
}

// The definition, implemented independently with the weights of the four nearest centres. Returns
// the smallest coverage over the cameras, or -1 if one does not see p.
inline double min_coverage(std::span<const CoverageSilhouette> silhouettes,
                           const Eigen::Vector3d& p_world_m) {
  double smallest = silhouettes.empty() ? -1 : 1;
  for (const CoverageSilhouette& s : silhouettes) {
    const auto uv = geometry::project(s.camera, p_world_m);
    const int width = s.map.width_px(), height = s.map.height_px();
    if (!uv ||
        !(uv->x() >= -0.5 && uv->y() >= -0.5 && uv->x() < width - 0.5 && uv->y() < height - 0.5))
      return -1;
    const double u = std::clamp(uv->x(), 0.0, width - 1.0),
                 v = std::clamp(uv->y(), 0.0, height - 1.0);
    double coverage = 0;
    for (int y = int(v); y <= std::min(int(v) + 1, height - 1); ++y)
      for (int x = int(u); x <= std::min(int(u) + 1, width - 1); ++x)
        coverage += (1 - std::abs(u - x)) * (1 - std::abs(v - y)) * s.map.at(x, y) / 255.0;
    smallest = std::min(smallest, coverage);
  }
  return smallest;
}

struct Counts {
  int hits = 0, between_samples = 0;
};

// Compares one ray with the first sample in the hull and the border before it, found by bisection.
// A piece between two samples is compared with the definition only at its start, and counted.
inline void expect_definition(Counts& counts, std::span<const CoverageSilhouette> silhouettes,
                              const geometry::Ray& ray, const View& view, float depth_m) {
  const auto coverage = [&](double t) {
    return min_coverage(silhouettes, ray.origin_world_m + t * ray.direction_world);
  };
  const double step = (view.far_m - view.near_m) / kSamples;
  double expected = kNoHull;
  for (int i = 0; i < kSamples; ++i) {
    double in = i == 0 ? view.near_m + kNearestSample_m : view.near_m + i * step,
           out = view.near_m + std::max(i - 1, 0) * step;
    if (coverage(in) < 0.5) continue;
    for (int k = 0; i > 0 && k < 50; ++k)
      (coverage(0.5 * (out + in)) >= 0.5 ? in : out) = 0.5 * (out + in);
    expected = i == 0 ? view.near_m : in;
    break;
  }
  counts.hits += depth_m != kNoHull;
  if (std::abs(depth_m - expected) <= kAgree_m) return;
  EXPECT_TRUE(depth_m != kNoHull && (expected == kNoHull || depth_m < expected))
      << "depth " << depth_m << " m, expected " << expected;
  ++counts.between_samples;
  const double slack = kAgree_m;
  EXPECT_GE(std::max({coverage(depth_m - slack), coverage(depth_m), coverage(depth_m + slack)}),
            0.5 - kOnBorder)
      << "depth " << depth_m << " m is not in the hull";
}

inline Counts expect_definition(std::span<const CoverageSilhouette> silhouettes, const View& view,
                                int step = 1) {
  Counts counts;
  const DepthTile tile = depth_of(silhouettes, view);
  const int width = tile.rect.width_px();
  for (int i = 0; i < int(tile.depth_m.size()); i += step) {
    SCOPED_TRACE(i);
    expect_definition(counts, silhouettes,
                      geometry::ray_through(view.camera, Eigen::Vector2d(i % width, i / width)),
                      view, tile.depth_m[i]);
  }
  return counts;
}

inline bool no_hull(const DepthTile& tile) {
  return std::all_of(tile.depth_m.begin(), tile.depth_m.end(),
                     [](float d) { return d == kNoHull; });
}

inline std::vector<CoverageSilhouette> covered(const std::vector<Capsule>& object,
                                               const std::vector<geometry::Camera>& cameras) {
  std::vector<CoverageSilhouette> silhouettes;
  for (const geometry::Camera& camera : cameras)
    silhouettes.push_back({camera, true_coverage(object, camera)});
  return silhouettes;
}

inline std::vector<CoverageSilhouette> covered(const test::RandomScene& scene) {
  return covered(scene.object, scene.cameras);
}

inline CoverageMap random_map(test::Random& random, int width_px, int height_px,
                              double inside_fraction) {
  CoverageMap map(width_px, height_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u)
      map.set(u, v,
              std::uint8_t(test::uniform(random, 0, 1) < inside_fraction
                               ? test::uniform(random, 128, 256)
                               : test::uniform(random, 0, 128)));
  return map;
}

}  // namespace fivepipe::hull
