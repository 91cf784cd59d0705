// preserve_thin() keeps parts thinner than a pixel connected: wires of 0.2 to 2 px at all angles
// and offsets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <queue>

#include "common/base/timing.h"
#include "common/hull/coverage/coverage_hull.h"
#include "common/hull/coverage/thin_coverage.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSize_px = 64;
constexpr double kLength_px = 44;
constexpr double kEnd_px = 3.0;

// One camera that faces a wire in the plane z = 1 m. A pixel is 1 mm there, and the wire is a strip
// with round ends.
struct Wire {
  double width_px, angle_rad;
  Vector2d center_px;
  Vector2d along() const { return {std::cos(angle_rad), std::sin(angle_rad)}; }
  CoverageMap map() const {
    const geometry::Camera camera{{kSize_px, kSize_px, 1000, 1000, 0, 0},
                                  Eigen::Isometry3d::Identity()};
    const Vector2d a = (center_px - 0.5 * kLength_px * along()) / 1000,
                   b = (center_px + 0.5 * kLength_px * along()) / 1000;
    const Capsule capsule{{a.x(), a.y(), 1}, {b.x(), b.y(), 1}, width_px / 2000};
    return true_coverage({&capsule, 1}, camera);
  }
};
Wire random_wire(test::Random& random, double width_px) {
  return {width_px, test::uniform(random, 0, std::numbers::pi),
          Vector2d{32 + test::uniform(random, -0.5, 0.5), 32 + test::uniform(random, -0.5, 0.5)}};
}

// Returns true if both pixels are above one half and connected. Four-neighbours are connected by
// the edge of the interpolant; diagonal neighbours are connected if the saddle between them is
// above one half.
bool joined(const CoverageMap& m, int u, int v, int du, int dv) {
  if (side_of_border(m.at(u, v)) < 0 || side_of_border(m.at(u + du, v + dv)) < 0) return false;
  if (du == 0 || dv == 0) return true;
  const int a = side_of_border(m.at(u + du, v)), b = side_of_border(m.at(u, v + dv));
  return a > 0 || b > 0 ||
         side_of_border(m.at(u, v)) * side_of_border(m.at(u + du, v + dv)) > a * b;
}

// Returns true if the wire's level set is connected from end to end, except for kEnd_px at each
// end.
bool unbroken(const CoverageMap& m, const Wire& wire) {
  const auto along = [&](int u, int v) {
    return (Vector2d(u, v) - wire.center_px).dot(wire.along());
  };
  std::vector<char> seen(kSize_px * kSize_px);
  std::queue<std::pair<int, int>> queue;
  for (int v = 1; v < kSize_px - 1; ++v)
    for (int u = 1; u < kSize_px - 1; ++u)
      if (side_of_border(m.at(u, v)) > 0 && along(u, v) < -0.5 * kLength_px + kEnd_px)
        queue.push({u, v});
  while (!queue.empty()) {
    const auto [u, v] = queue.front();
    queue.pop();
    if (u < 1 || v < 1 || u >= kSize_px - 1 || v >= kSize_px - 1 || seen[v * kSize_px + u])
      continue;
    seen[v * kSize_px + u] = 1;
    if (along(u, v) > 0.5 * kLength_px - kEnd_px) return true;
    for (int dv = -1; dv <= 1; ++dv)
      for (int du = -1; du <= 1; ++du)
        if (joined(m, u, v, du, dv)) queue.push({u + du, v + dv});
  }
  return false;
}

struct Level {
  double width_px,
      farthest_px;  // mean over the wire without its ends; distance of the level set from the axis
};
Level level_of(const SparseCoverageMap& m, const Wire& wire) {
  constexpr int kPerPixel = 8;
  const double half = 0.5 * kLength_px - 4;
  Level level{0, 0};
  for (int j = 0; j < kSize_px * kPerPixel; ++j)
    for (int i = 0; i < kSize_px * kPerPixel; ++i) {
      const Vector2d uv((i + 0.5) / kPerPixel - 0.5, (j + 0.5) / kPerPixel - 0.5),
          d = uv - wire.center_px;
      const double across = std::abs(d.x() * wire.along().y() - d.y() * wire.along().x());
      if (across > 3 || std::abs(d.dot(wire.along())) > half ||
          m.interpolated(uv.x(), uv.y()) < 0.5)
        continue;
      level.width_px += 1.0 / (kPerPixel * kPerPixel) / (2 * half);
      level.farthest_px = std::max(level.farthest_px, across);
    }
  return level;
}

// Wires at any angle: every fourth within 2 degrees of a diagonal or exactly on it, every eighth
// along rows or columns. Half as many in the quick run, fewer with a sanitizer.
int sample_divisor() { return kHasSanitizer ? kSlowdown : std::getenv("FIVEPIPE_LONG") ? 1 : 2; }
std::vector<Wire> wires(double width_px, int count) {
  test::Random random(unsigned(width_px * 1000));
  std::vector<Wire> all;
  for (int i = 0; i < count / sample_divisor(); ++i) {
    all.push_back(random_wire(random, width_px));
    if (i % 4 == 0)
      all.back().angle_rad = std::numbers::pi / 4 * (1 + i % 8 / 2) +
                             (i % 3 == 0 ? 0 : test::uniform(random, -0.035, 0.035));
    if (i % 8 == 1) all.back().angle_rad = std::numbers::pi / 2 * (i % 16 / 8);
  }
  return all;
}
const double kWidths_px[] = {0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8,
                             0.9, 1.0,  1.1, 1.2, 1.3, 1.5, 1.7, 2.0};

TEST(ThinCoverage, KeepsWiresConnected) {
  int broken_before = 0;
  for (const double width_px : kWidths_px)
    for (const Wire& wire : wires(width_px, 80)) {
      const CoverageMap map = wire.map();
      broken_before += !unbroken(map, wire);
      for (const ThinRule rule : {ThinRule::contained, ThinRule::as_wide})
        EXPECT_TRUE(unbroken(preserve_thin(map, {.rule = rule}), wire))
            << width_px << " px, " << wire.angle_rad << " rad at " << wire.center_px.transpose();
    }
  EXPECT_GT(broken_before, 500 / sample_divisor());
}

TEST(ThinCoverage, ContainedRuleKeepsTheAxisInside) {
  for (const double width_px : kWidths_px)
    for (const Wire& wire : wires(width_px, 80)) {
      const SparseCoverageMap kept = preserve_thin(wire.map());
      for (double t = -0.5 * kLength_px + kEnd_px; t <= 0.5 * kLength_px - kEnd_px; t += 0.05) {
        const Vector2d uv = wire.center_px + t * wire.along();
        EXPECT_GE(kept.interpolated(uv.x(), uv.y()), 0.5)
            << width_px << " px, " << wire.angle_rad << " rad at " << wire.center_px.transpose()
            << ", " << t;
      }
    }
}

TEST(ThinCoverage, WiresKeepTheirWidthAndPosition) {
  std::printf("%5s | %-17s | %-26s | %-26s\n", "wire", "no rule: width px",
              "contained: width, beyond", "as wide: width, beyond");
  for (const double width_px : {0.2, 0.3, 0.5, 0.7, 0.9, 1.0, 1.2, 1.5, 2.0}) {
    std::vector<double> before, widths[2], beyond[2];
    for (const Wire& wire : wires(width_px, 48)) {
      const CoverageMap map = wire.map();
      before.push_back(level_of(map, wire).width_px);
      for (const ThinRule rule : {ThinRule::contained, ThinRule::as_wide}) {
        const Level level = level_of(preserve_thin(map, {.rule = rule}), wire);
        widths[int(rule)].push_back(level.width_px);
        beyond[int(rule)].push_back(level.farthest_px - width_px / 2);
      }
    }
    std::printf("%5.2f | %5.2f %5.2f %5.2f", width_px, base::percentile(before, 0.05),
                base::percentile(before, 0.5), base::percentile(before, 0.95));
    for (int rule = 0; rule < 2; ++rule)
      std::printf(" | %5.2f %5.2f %5.2f, %5.2f %5.2f", base::percentile(widths[rule], 0.05),
                  base::percentile(widths[rule], 0.5), base::percentile(widths[rule], 0.95),
                  base::percentile(beyond[rule], 0.5), base::percentile(beyond[rule], 1));
    std::printf("\n");
    // Connecting pixels at a corner widens very thin wires; eight samples per pixel resolve 1/16
    // px.
    EXPECT_NEAR(base::percentile(widths[1], 0.5), width_px, 0.11);
    EXPECT_LE(base::percentile(beyond[1], 1),
              std::max(0.0, 1 - width_px) / 2 + 0.25);  // moved to the row, connected at corners;
                                                        // 0.09 px is the error of the interpolant
    EXPECT_GE(base::percentile(widths[0], 0.05), std::min(1.0, width_px) - 0.4);
    EXPECT_LE(base::percentile(beyond[0], 1), std::max(0.0, 1 - width_px) / 2 + 0.5);
  }
}

TEST(ThinCoverage, RowAlignedStripsKeepTheirWidthOrBorders) {
  for (int c = 40; c < 255; ++c) {  // strips within the row
    CoverageMap map(9, 9);
    for (int u = 0; u < 9; ++u) map.set(u, 4, std::uint8_t(c));
    const double w = c / 255.0, half = 0.5 * w,
                 quantum = 1.0 / 255;  // of coverage; moves a border by at most 1/255 px
    const SparseCoverageMap as_wide = preserve_thin(map, {.rule = ThinRule::as_wide}),
                            contained = preserve_thin(map);
    for (const double side : {-1.0, 1.0}) {
      EXPECT_GE(as_wide.interpolated(4, 4 + side * (half - 1e-9)), 0.5);
      EXPECT_LT(as_wide.interpolated(4, 4 + side * (half + 3 * quantum)), 0.5);
      EXPECT_GE(contained.interpolated(4, 4 + side * 0.4999), 0.5);
    }
  }
  for (int above = 1; above < 127;
       above += 7)  // strips across the border of two rows: [1/2 - above, 1/2 + below]
    for (int below = above; below < 127; below += 7) {
      if (above + below < 45) continue;
      CoverageMap map(9, 9);
      for (int u = 0; u < 9; ++u)
        map.set(u, 3, std::uint8_t(above)), map.set(u, 4, std::uint8_t(below));
      const SparseCoverageMap contained = preserve_thin(map);
      EXPECT_GE(contained.interpolated(4, 3.5 - above / 255.0 + 1e-9), 0.5)
          << above << ' ' << below;
      EXPECT_GE(contained.interpolated(4, 3.5 + below / 255.0 - 1e-9), 0.5)
          << above << ' ' << below;
    }
}

// A strip that covers two rows or columns equally moves to the first one.
TEST(ThinCoverage, OfTwoEqualRowsTheFirstIsRaised) {
  for (const int c : {30, 60, 100, 120})
    for (const bool columns : {false, true}) {
      SCOPED_TRACE(c);
      CoverageMap map(9, 9);
      for (int along = 0; along < 9; ++along)
        for (const int across : {3, 4})
          map.set(columns ? across : along, columns ? along : across, std::uint8_t(c));
      const CoverageMap contained = preserve_thin(map),
                        as_wide = preserve_thin(map, {.rule = ThinRule::as_wide});
      const double f = c / 255.0,  // the values of thin_coverage.h
          reaching = std::max(2 * f / (1 + 2 * f), 2 * 0.55 * 0.55 / (1.55 * 1.55));
      for (int along = 1; along < 8; ++along) {
        const auto at = [&](const CoverageMap& m, int across) {
          return int(columns ? m.at(across, along) : m.at(along, across));
        };
        EXPECT_EQ(at(contained, 2), 0);
        EXPECT_EQ(at(contained, 3), 255);
        EXPECT_EQ(at(contained, 4), std::max(c, int(std::ceil(255 * reaching))));
        EXPECT_EQ(at(contained, 5), 0);
        EXPECT_GE(at(as_wide, 3), 128);
        EXPECT_EQ(at(as_wide, 4), c);
      }
    }
}

TEST(ThinCoverage, KeepsDotsAndRemovesNoise) {
  for (const ThinRule rule : {ThinRule::contained, ThinRule::as_wide})
    for (const int c : {40, 60, 120}) {
      CoverageMap map(5, 5);
      map.set(2, 2, std::uint8_t(c));
      EXPECT_GE(preserve_thin(map, {.rule = rule}).at(2, 2), 128) << c;
    }
  CoverageMap speck(5, 5);
  speck.set(2, 2, 37);  // 0.145 px^2
  EXPECT_EQ(preserve_thin(speck), speck);
  test::Random random(2);
  std::normal_distribution<double> noise(0, 0.02 * 255);
  CoverageMap noisy(300, 300);
  for (int v = 0; v < 300; ++v)
    for (int u = 0; u < 300; ++u)
      noisy.set(u, v, std::uint8_t(std::clamp(noise(random), 0.0, 255.0)));
  const CoverageMap kept = preserve_thin(noisy);
  int wrong = 0;
  for (const std::uint8_t c : kept.bytes()) wrong += c >= 128;
  std::printf("noise of 2 percent: %d of 90000 pixels kept\n", wrong);
  EXPECT_LE(wrong, 10);  // four standard deviations: 3 in 90,000
}

TEST(ThinCoverage, LeavesGapsBinaryMapsAndThickObjectsUnchanged) {
  test::Random random(8);
  CoverageMap gap(24, 24), diagonal(24, 24);
  for (int v = 0; v < 24; ++v)
    for (int u = 0; u < 24; ++u) {
      gap.set(u, v, u == 12 ? std::uint8_t(test::uniform(random, 60, 120)) : std::uint8_t(255));
      diagonal.set(u, v, u == v ? std::uint8_t(test::uniform(random, 60, 120)) : std::uint8_t(255));
    }
  const CoverageMap binary = CoverageMap::from_pixels(test::random_pixels(random, 90, 67, 0.3));
  const geometry::Camera camera{{64, 64, 1000, 1000, 32, 32}, Eigen::Isometry3d::Identity()};
  const Capsule ball{{0, 0, 1}, {0, 0, 1}, 0.0123},
      bar{{-0.02, -0.013, 1}, {0.02, 0.011, 1}, 0.002};
  const std::vector<Capsule> both{ball, bar};
  for (const ThinRule rule : {ThinRule::contained, ThinRule::as_wide})
    for (const CoverageMap& map :
         {gap, diagonal, binary, true_coverage(both, camera), CoverageMap(), CoverageMap(1, 1)})
      EXPECT_EQ(preserve_thin(map, {.rule = rule}), map);
}

// A wire in space that is some pixels wide in all images.
struct WireRig {
  Vector3d center, half;
  std::vector<CoverageSilhouette> silhouettes;
};
WireRig wire_rig(test::Random& random, int cameras, double width_px, ThinRule rule) {
  WireRig rig{test::random_in_ball(random, 0.05), 0.15 * test::random_direction(random), {}};
  for (int i = 0; i < cameras; ++i) {
    const geometry::Camera camera{
        geometry::pinhole_from_fov(160, 160, 0.5),
        test::random_look_at(random, 1.5 * test::random_direction(random), Vector3d::Zero(), 0.02)};
    const Capsule wire{rig.center - rig.half, rig.center + rig.half,
                       0.5 * width_px * 1.5 / camera.pinhole.fx_px};
    rig.silhouettes.push_back(
        {camera, preserve_thin(true_coverage({&wire, 1}, camera), {.rule = rule})});
  }
  return rig;
}
// Returns true if p is more than kEnd_px from the ends of the wire in every image.
bool well_within(const WireRig& rig, const Vector3d& p_world_m) {
  return std::all_of(
      rig.silhouettes.begin(), rig.silhouettes.end(), [&](const CoverageSilhouette& s) {
        const auto uv = [&](const Vector3d& p) { return *geometry::project(s.camera, p); };
        return (uv(p_world_m) - uv(rig.center + rig.half)).norm() > kEnd_px &&
               (uv(p_world_m) - uv(rig.center - rig.half)).norm() > kEnd_px;
      });
}

// The hull contains the axis.
TEST(ThinCoverage, HullOfAWireIsConnectedAlongIt) {
  std::printf("share of a wire's axis in the hull\n%7s %5s %9s %7s\n", "cameras", "px", "contained",
              "as wide");
  for (const int cameras : {2, 3, 4, 6})
    for (const double width_px : {0.2, 0.3, 0.4, 0.7, 1.0, 1.5, 2.0}) {
      double in[2] = {}, all = 0;
      for (const ThinRule rule : {ThinRule::contained, ThinRule::as_wide}) {
        test::Random random(unsigned(width_px * 100) + unsigned(cameras));
        all = 0;
        for (int k = 0; k < 12 / kSlowdown; ++k) {
          const WireRig rig = wire_rig(random, cameras, width_px, rule);
          for (double t = -1; t <= 1; t += 0.002) {
            const Vector3d p = rig.center + t * rig.half;
            if (!well_within(rig, p)) continue;
            ++all;
            in[int(rule)] += in_hull(rig.silhouettes, p);
          }
        }
      }
      std::printf("%7d %5.1f %9.4f %7.4f\n", cameras, width_px, in[0] / all, in[1] / all);
      EXPECT_EQ(in[0], all);
    }
}

}  // namespace
}  // namespace fivepipe::hull
