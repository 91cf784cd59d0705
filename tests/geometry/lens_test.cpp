#include "common/geometry/lens.h"

#include <gtest/gtest.h>

#include <limits>

namespace fivepipe::test {
namespace {

using Eigen::Vector2d;
using geometry::LensDistortion;
using geometry::Pinhole;
using geometry::whole_pinhole;

const Pinhole kCaptured{320, 240, 300, 310, 150.5, 121};

// Pixel edges of an image.
Eigen::AlignedBox2d edges(const Pinhole& image) {
  return {Vector2d(-0.5, -0.5), Vector2d(image.width_px - 0.5, image.height_px - 0.5)};
}

TEST(WholePinhole, IsTheCapturedOneWithoutDistortion) {
  EXPECT_EQ(whole_pinhole(kCaptured, {}), kCaptured);
}

// Every captured pixel has its place in it, and no row or column of it is empty that was added.
TEST(WholePinhole, ContainsAllThatTheImageShowsAndNoMore) {
  for (const LensDistortion& lens : {LensDistortion{-0.3, 0.1, 0, 0, 0},
                                     {-0.1, 0, 0.01, -0.02, 0},
                                     {-0.36, 0.18, 0.0008, -0.0005, -0.05},
                                     {0.2, -0.05, 0, 0, 0},
                                     {-0.05, 0.14, 0.0006, 0.0007, 0}}) {
    const Pinhole whole = whole_pinhole(kCaptured, lens);
    EXPECT_EQ(whole.fx_px, kCaptured.fx_px);
    EXPECT_EQ(whole.fy_px, kCaptured.fy_px);
    const Vector2d moved_px(whole.cx_px - kCaptured.cx_px, whole.cy_px - kCaptured.cy_px);
    EXPECT_EQ(moved_px, Vector2d(moved_px.array().round())) << "by whole pixels";
    Eigen::AlignedBox2d used_px = edges(kCaptured);
    used_px.translate(moved_px);
    for (int v = 0; v < kCaptured.height_px; ++v)
      for (int u = 0; u < kCaptured.width_px; ++u)
        for (const Vector2d& corner :
             {Vector2d(-0.49, -0.49), {0.49, -0.49}, {-0.49, 0.49}, {0.49, 0.49}}) {
          const Vector2d xy = undistorted(kCaptured, lens, Vector2d(u, v) + corner);
          used_px.extend(
              Vector2d(xy.x() * whole.fx_px + whole.cx_px, xy.y() * whole.fy_px + whole.cy_px));
        }
    EXPECT_TRUE(edges(whole).contains(used_px)) << lens.k1;
    EXPECT_LT((edges(whole).sizes() - used_px.sizes()).maxCoeff(), 2.1) << lens.k1;
  }
}

// A crop of a larger sensor, whose axis is beside the image.
TEST(WholePinhole, OfACropContainsAllThatItShows) {
  const LensDistortion lens{-0.3, 0.1, 0, 0, 0};
  const Pinhole crop{200, 150, 300, 300, -120, -60}, whole = whole_pinhole(crop, lens);
  for (const Vector2d& uv : {Vector2d(0, 0), {199, 0}, {0, 149}, {199, 149}, {100, 149}}) {
    const Vector2d xy = undistorted(crop, lens, uv);
    EXPECT_TRUE(edges(whole).contains(
        Vector2d(xy.x() * whole.fx_px + whole.cx_px, xy.y() * whole.fy_px + whole.cy_px)))
        << uv.transpose();
  }
  EXPECT_GT(whole.width_px, 210);
  EXPECT_LT(whole.width_px, 300);
}

TEST(WholePinhole, EndsWhereTheLensModelFolds) {
  const LensDistortion folds{-0.4, 0, 0, 0, 0};  // at a radius of 0.913
  const Pinhole wide{400, 400, 150, 150, 199.5, 199.5};
  const Pinhole whole = whole_pinhole(wide, folds);
  EXPECT_EQ(whole, wide) << "the fold is at 137 of 200 px";
  const Pinhole narrow = whole_pinhole({160, 160, 150, 150, 79.5, 79.5}, folds);
  EXPECT_GT(narrow.width_px, 200);
  EXPECT_LE(narrow.width_px, 2 * 137 + 2);
}

// The caller refuses images that are too large.
TEST(WholePinhole, ExtremeModelsGiveNoNumberBeyondAnInt) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  for (const double k : {1e300, -1e300, kLargest, -kLargest, 1e-300})
    for (const double f_px : {1e-300, 1.0, 1e12, kLargest}) {
      const Pinhole whole = whole_pinhole({640, 480, f_px, f_px, 320, 240}, {k, -k, k, k, k});
      EXPECT_GE(whole.width_px, 640);
      EXPECT_LE(whole.width_px, 1'000'000'000);
      EXPECT_GE(whole.height_px, 480);
    }
}

}  // namespace
}  // namespace fivepipe::test
