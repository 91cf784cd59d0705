// Values of coverage maps: the lattice, the interpolation, the fitted plane and thin parts.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "common/hull/coverage/coverage_hull.h"
#include "common/hull/coverage/thin_coverage.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

CoverageMap random_coverage(Random& random, int width_px, int height_px) {
  CoverageMap map(width_px, height_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) map.set(u, v, std::uint8_t(random() % 256));
  return map;
}

TEST(TrueCoverage, CountsTheFibonacciLatticeOf233Points) {
  for (int seed = 1; seed <= 3; ++seed) {
    Random random(seed);
    const auto object = random_object(random, 2);
    const geometry::Camera camera = random_camera(random, 40, 31);
    const CoverageMap map = true_coverage(object, camera);
    int partly = 0;
    for (int v = 0; v < 31; ++v)
      for (int u = 0; u < 40; ++u) {
        int in = 0;
        for (int i = 0; i < 233; ++i)
          in += in_silhouette(object, camera,
                              {u - 0.5 + (i + 0.5) / 233, v - 0.5 + (144 * i % 233 + 0.5) / 233});
        ASSERT_EQ(map.at(u, v), std::lround(in * 255 / 233.0)) << u << ", " << v;
        partly += in > 0 && in < 233;
      }
    EXPECT_GT(partly, 10);
  }
}

TEST(CoverageMap, KeepsItsBytes) {
  Random random(2);
  CoverageMap map = random_coverage(random, 7, 5);
  EXPECT_EQ(map.width_px(), 7);
  EXPECT_EQ(map.height_px(), 5);
  EXPECT_EQ(CoverageMap::from_bytes(7, 5, map.bytes()), map);
  EXPECT_EQ(map.at(3, 2), map.bytes()[2 * 7 + 3]);
  ObjectPixels pixels(3, 2);
  pixels.set(2, 1);
  const CoverageMap binary = CoverageMap::from_pixels(pixels);
  EXPECT_EQ(binary.at(2, 1), 255);
  EXPECT_EQ(binary.at(1, 1), 0);
  EXPECT_EQ(CoverageMap(3, 2).bytes().size(), 6u);
  EXPECT_EQ(CoverageMap(), CoverageMap(0, 0));
  EXPECT_GT(side_of_border(128), 0);
  EXPECT_LT(side_of_border(127), 0);
  EXPECT_EQ(side_of_border(255), 255);
}

TEST(CoverageMap, InterpolatesBetweenPixelCentres) {
  Random random(3);
  const CoverageMap map = random_coverage(random, 6, 4);
  const SparseCoverageMap sparse = map;
  for (int i = 0; i < 500; ++i) {
    const double u = uniform(random, -0.5, 5.5), v = uniform(random, -0.5, 3.5);
    double expected = 0;  // a hat function on each pixel; the outermost extend outward
    for (int y = -1; y <= 4; ++y)
      for (int x = -1; x <= 6; ++x)
        expected += std::max(0.0, 1 - std::abs(u - x)) * std::max(0.0, 1 - std::abs(v - y)) *
                    map.at(std::clamp(x, 0, 5), std::clamp(y, 0, 3));
    EXPECT_NEAR(sparse.interpolated(u, v), expected / 255, 1e-12);
  }
  EXPECT_EQ(sparse.interpolated(-0.5, -0.5), map.at(0, 0) / 255.0);
  for (const auto& [u, v] : {std::pair{-0.5001, 1.0},
                             {5.5, 1.0},
                             {1.0, -0.5001},
                             {1.0, 3.5},
                             {std::nan(""), 1.0},
                             {1.0, std::nan("")}})
    EXPECT_EQ(sparse.interpolated(u, v), 0);
}

// The plane by QR of the weighted equations, over a window of 7x7 pixels.
TEST(CoverageMap, OutwardIsDownhillOfTheWeightedPlane) {
  Random random(4);
  const CoverageMap map = random_coverage(random, 20, 15);
  int at_border = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector2d uv{uniform(random, -0.5, 19.5), uniform(random, -0.5, 14.5)};
    const int u0 = int(std::floor(uv.x() + 0.5)), v0 = int(std::floor(uv.y() + 0.5));
    std::vector<Eigen::Vector4d> rows;
    for (int v = std::max(v0 - 3, 0); v <= std::min(v0 + 3, 14); ++v)
      for (int u = std::max(u0 - 3, 0); u <= std::min(u0 + 3, 19); ++u) {
        const double root_weight = std::exp(-0.25 * (Vector2d(u, v) - uv).squaredNorm());
        rows.push_back(root_weight * Eigen::Vector4d(1, u - uv.x(), v - uv.y(), map.at(u, v)));
      }
    at_border += rows.size() < 49;
    Eigen::MatrixXd a(rows.size(), 3);
    Eigen::VectorXd b(rows.size());
    for (std::size_t r = 0; r < rows.size(); ++r)
      a.row(Eigen::Index(r)) = rows[r].head<3>(), b[Eigen::Index(r)] = rows[r][3];
    const Vector2d gradient = a.colPivHouseholderQr().solve(b).tail<2>();
    const auto outward = outward_in_image(map, uv);
    ASSERT_EQ(outward.has_value(), gradient.norm() > 1);
    if (outward) {
      EXPECT_NEAR((*outward + gradient.normalized()).norm(), 0, 1e-9);
    }
  }
  EXPECT_GT(at_border, 50);
  for (const Vector2d& outside : {Vector2d(-0.51, 3), Vector2d(19.5, 3), Vector2d(3, -0.51),
                                  Vector2d(3, 14.5), Vector2d(std::nan(""), 3)})
    EXPECT_FALSE(outward_in_image(map, outside));
}

// A slope of one level per pixel is within the rounding of 8 bits.
TEST(CoverageMap, OutwardNeedsAFallOfMoreThanOneLevelPerPixel) {
  const auto ramp = [](int per_px) {
    CoverageMap map(20, 15);
    for (int v = 0; v < 15; ++v)
      for (int u = 0; u < 20; ++u) map.set(u, v, std::uint8_t(100 + per_px * u));
    return outward_in_image(map, {9.8, 7.1});
  };
  EXPECT_FALSE(ramp(0));
  ASSERT_TRUE(ramp(2));
  EXPECT_NEAR((*ramp(2) - Vector2d(-1, 0)).norm(), 0, 1e-9);
  EXPECT_FALSE(outward_in_image(
      [] {
        CoverageMap map(20, 15);
        for (int v = 0; v < 15; ++v)
          for (int u = 0; u < 20; ++u) map.set(u, v, std::uint8_t(100 + 9 * u / 10));
        return map;
      }(),
      {9.8, 7.1}));
}

// What preserve_thin() adds to a map: the number of pixels, their levels, and these weighted by the
// column and by the row. Another order of roundings may change a level by one.
struct Raised {
  int pixels;
  double levels, by_column, by_row;
};
Raised raised_by(const CoverageMap& map, const PreserveThin& keep) {
  const CoverageMap kept = preserve_thin(map, keep);
  Raised raised{};
  for (int v = 0; v < map.height_px(); ++v)
    for (int u = 0; u < map.width_px(); ++u) {
      const int by = kept.at(u, v) - map.at(u, v);
      EXPECT_GE(by, 0);
      raised.pixels += by > 0;
      raised.levels += by, raised.by_column += by * u, raised.by_row += by * v;
    }
  return raised;
}

// Maps in which each rule raises many pixels: noise of all levels, sparse noise, and wires.
constexpr Raised kRaised[6][3] = {
    {{1497, 76104, 2460756, 1828689}, {779, 36164, 1169375, 865038}, {656, 26655, 837235, 632602}},
    {{1513, 102404, 3225115, 2361596},
     {1289, 68278, 2165833, 1573801},
     {769, 26746, 837788, 610582}},
    {{515, 40547, 1207148, 985889}, {473, 25062, 731293, 606228}, {219, 6133, 219115, 141546}},
    {{136, 15334, 373526, 517117}, {112, 9402, 239625, 315054}, {4, 268, 9106, 8978}},
    {{282, 17555, 491027, 265833}, {168, 6711, 186563, 105420}, {165, 6491, 183841, 101758}},
    {{99, 1733, 62038, 40600}, {33, 410, 15822, 9715}, {31, 268, 10192, 5723}},
};

TEST(ThinCoverage, ValuesOfEveryPixelAreKnown) {
  for (int n = 0; n < 6; ++n) {
    Random random(n + 1);
    CoverageMap map(64, 48);
    if (n < 3) {
      map = random_coverage(random, 64, 48);
      for (int v = 0; v < 48; ++v)
        for (int u = 0; u < 64; ++u)
          if (n > 0 && random() % (n == 1 ? 2 : 6)) map.set(u, v, 0);
    } else {
      const geometry::Camera camera{{64, 48, 1000, 1000, 0, 0}, Eigen::Isometry3d::Identity()};
      std::vector<Capsule> wires;
      for (int i = 0; i < 4; ++i) {
        const auto end = [&] {
          const double y_m = uniform(random, 0, 0.048), x_m = uniform(random, 0, 0.064);
          return Vector3d(x_m, y_m, 1);
        };
        wires.push_back({end(), end(), (n == 3 ? 0.3 : n == 4 ? 0.7 : 1.3) / 2000});
      }
      map = true_coverage(wires, camera);
    }
    const PreserveThin rules[] = {{}, {ThinRule::as_wide}, {ThinRule::as_wide, 0.6}};
    for (const int k : {0, 1, 2}) {
      SCOPED_TRACE(3 * n + k);
      const Raised raised = raised_by(map, rules[k]), &known = kRaised[n][k];
      EXPECT_NEAR(raised.pixels, known.pixels, 1);
      EXPECT_NEAR(raised.levels, known.levels, 3);
      EXPECT_NEAR(raised.by_column, known.by_column, 3 * 64);
      EXPECT_NEAR(raised.by_row, known.by_row, 3 * 48);
    }
  }
  EXPECT_EQ(PreserveThin{}.rule, ThinRule::contained);
  EXPECT_EQ(PreserveThin{}.min_width_px, 0.15);
}

}  // namespace
}  // namespace fivepipe::hull
