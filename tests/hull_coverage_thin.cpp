// Things thinner than a pixel in coverage maps: wires of 0.2 to 2 px at all angles and offsets are kept without gaps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <queue>

#include "common/hull/coverage_hull.h"
#include "common/hull/thin_coverage.h"
#include "tests/hull_scenes.h"

namespace fivepipe {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSize_px = 64;
constexpr double kLength_px = 44;
constexpr double kEnd_px = 3.0;

// One camera before a wire in the plane z = 1 m square to it: a pixel is a millimetre there, and the wire a strip with round ends.
struct Wire {
  double width_px, angle_rad;
  Vector2d middle_px;
  Vector2d along() const { return {std::cos(angle_rad), std::sin(angle_rad)}; }
  CoverageMap map() const {
    const Camera camera{{kSize_px, kSize_px, 1000, 1000, 0, 0}, Eigen::Isometry3d::Identity()};
    const Vector2d a = (middle_px - 0.5 * kLength_px * along()) / 1000, b = (middle_px + 0.5 * kLength_px * along()) / 1000;
    const Capsule capsule{{a.x(), a.y(), 1}, {b.x(), b.y(), 1}, width_px / 2000};
    return true_coverage({&capsule, 1}, camera);
  }
};
Wire random_wire(Random& random, double width_px) {
  return {width_px, uniform(random, 0, std::numbers::pi), Vector2d(32 + uniform(random, -0.5, 0.5), 32 + uniform(random, -0.5, 0.5))};
}

// Inside pixels that hang together: 4-neighbours by an edge of the interpolant, diagonal ones where its saddle is above one half.
bool joined(const CoverageMap& m, int u, int v, int du, int dv) {
  if (side_of_border(m.at(u, v)) < 0 || side_of_border(m.at(u + du, v + dv)) < 0) return false;
  if (du == 0 || dv == 0) return true;
  const int a = side_of_border(m.at(u + du, v)), b = side_of_border(m.at(u, v + dv));
  return a > 0 || b > 0 || side_of_border(m.at(u, v)) * side_of_border(m.at(u + du, v + dv)) > a * b;
}

// The wire's level set runs from one end, but for kEnd_px, to the other.
bool unbroken(const CoverageMap& m, const Wire& wire) {
  const auto along = [&](int u, int v) { return (Vector2d(u, v) - wire.middle_px).dot(wire.along()); };
  std::vector<char> seen(kSize_px * kSize_px);
  std::queue<std::pair<int, int>> queue;
  for (int v = 1; v < kSize_px - 1; ++v)
    for (int u = 1; u < kSize_px - 1; ++u)
      if (side_of_border(m.at(u, v)) > 0 && along(u, v) < -0.5 * kLength_px + kEnd_px) queue.push({u, v});
  while (!queue.empty()) {
    const auto [u, v] = queue.front();
    queue.pop();
    if (u < 1 || v < 1 || u >= kSize_px - 1 || v >= kSize_px - 1 || seen[v * kSize_px + u]) continue;
    seen[v * kSize_px + u] = 1;
    if (along(u, v) > 0.5 * kLength_px - kEnd_px) return true;
    for (int dv = -1; dv <= 1; ++dv)
      for (int du = -1; du <= 1; ++du)
        if (joined(m, u, v, du, dv)) queue.push({u + du, v + dv});
  }
  return false;
}

struct Level {
  double width_px, farthest_px;  // mean, over the wire but for its ends; of the level set from the axis
};
Level level_of(const CoverageMap& m, const Wire& wire) {
  constexpr int kPerPixel = 8;
  const double half = 0.5 * kLength_px - 4;
  Level level{0, 0};
  for (int j = 0; j < kSize_px * kPerPixel; ++j)
    for (int i = 0; i < kSize_px * kPerPixel; ++i) {
      const Vector2d uv((i + 0.5) / kPerPixel - 0.5, (j + 0.5) / kPerPixel - 0.5), d = uv - wire.middle_px;
      const double across = std::abs(d.x() * wire.along().y() - d.y() * wire.along().x());
      if (across > 3 || std::abs(d.dot(wire.along())) > half || m.interpolated(uv.x(), uv.y()) < 0.5) continue;
      level.width_px += 1.0 / (kPerPixel * kPerPixel) / (2 * half);
      level.farthest_px = std::max(level.farthest_px, across);
    }
  return level;
}

TEST(Explore, Thin) {
  for (const ThinRule rule : {ThinRule::contained, ThinRule::as_wide})
  for (const double width : {0.2, 0.3, 0.5, 0.7, 0.9, 1.0, 1.2, 1.4, 1.7, 2.0}) {
    Random random(unsigned(width * 100));
    int axis = 0, axis_in = 0; double least = 1; int plain = 0, kept = 0, n = 0;
    std::vector<double> widths, before, off;
    for (int i = 0; i < 200; ++i) {
      Wire wire = random_wire(random, width);
      if (i % 4 == 0) wire.angle_rad = std::numbers::pi / 4 * (1 + 2 * (i % 8 / 4)) + (i % 3 == 0 ? 0 : uniform(random, -0.03, 0.03));
      if (i % 8 == 1) wire.angle_rad = std::numbers::pi / 2 * (i % 16 / 8);
      const CoverageMap map = wire.map(), thin = keep_thin(map, {rule, 0.15});
      for (double t = -18; t <= 18; t += 0.05) { ++axis; const Vector2d uv = wire.middle_px + t * wire.along(); const double c = thin.interpolated(uv.x(), uv.y()); axis_in += c >= 0.5; least = std::min(least, c);}
      ++n;
      plain += unbroken(map, wire);
      const bool ok = unbroken(thin, wire);
      kept += ok;
      if (!ok && kept > i - 3) std::printf("broken: w %.2f angle %.4f deg at %.3f %.3f\n", width, wire.angle_rad * 180 / std::numbers::pi, wire.middle_px.x(), wire.middle_px.y());
      const Level a = level_of(thin, wire);
      widths.push_back(a.width_px);
      off.push_back(a.farthest_px - width / 2);
      before.push_back(level_of(map, wire).width_px);
    }
    const auto pc = [](std::vector<double> x, double p) { std::sort(x.begin(), x.end()); return x[std::size_t(p * double(x.size() - 1))]; };
    std::printf("axis in %.4f least %.3f; ", double(axis_in) / axis, least); std::printf("width %.2f: unbroken %d -> %d of %d; level's width before %.3f %.3f %.3f after %.3f %.3f %.3f; beyond the wire %.3f %.3f\n", width, plain, kept, n, pc(before, .05), pc(before, .5),
                pc(before, .95), pc(widths, .05), pc(widths, .5), pc(widths, .95), pc(off, .5), pc(off, 1));
  }
}

TEST(Explore, Wires3D) {
  for (const ThinRule rule : {ThinRule::contained, ThinRule::as_wide})
    for (const int n : {2, 3, 4, 6})
      for (const double width : {0.2, 0.4, 0.7, 1.0, 1.5, 2.0}) {
        Random random(unsigned(width * 100) + n);
        int in = 0, all = 0;
        double least = 1;
        for (int k = 0; k < 30; ++k) {
          std::vector<CoverageSilhouette> silhouettes;
          const Vector3d middle = random_in_ball(random, 0.05), half = 0.15 * random_direction(random);
          for (int i = 0; i < n; ++i) {
            const Camera camera{pinhole_from_fov(160, 160, 0.5), look_at(1.5 * random_direction(random), random_in_ball(random, 0.02), random_direction(random))};
            const Capsule wire{middle - half, middle + half, 0.5 * width * 1.5 / camera.pinhole.fx_px};
            silhouettes.push_back({camera, keep_thin(true_coverage({&wire, 1}, camera), {rule, 0.15})});
          }
          for (double t = -0.9; t <= 0.9; t += 0.002) {
            ++all;
            in += in_hull(silhouettes, middle + t * half);
            for (const auto& s : silhouettes) { const auto uv = *project(s.camera, middle + t * half); least = std::min(least, s.map.interpolated(uv.x(), uv.y())); }
          }
        }
        std::printf("rule %d cameras %d width %.1f: axis in the hull %.4f least %.3f\n", int(rule), n, width, double(in) / all, least);
      }
}

}  // namespace
}  // namespace fivepipe
