// Footprints of boxes at the borders of the image.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture_node/object_colour.h"

namespace fivepipe::capture {
namespace {

// A box of a sixtieth of a pixel. With the margin, it is a square; the pixels that touch the square
// are its footprint.
TEST(Footprint, OfATinyBoxIsTheSquareOfTheMarginAlsoAtTheBorder) {
  constexpr int kWidth_px = 90, kHeight_px = 70;
  constexpr double kHalf_m = 1e-4;  // at a depth of 1 m
  const geometry::Camera camera{geometry::pinhole_from_fov(kWidth_px, kHeight_px, 1.0),
                                Eigen::Isometry3d::Identity()};
  const geometry::Pinhole& k = camera.pinhole;
  struct Range {
    int begin, end;
  };
  // A box beyond the margin around the image has no footprint.
  const auto expected = [](double at_px, int margin_px, int size_px) {
    const Range range{std::max(0, int(std::floor(at_px - margin_px + 0.5))),
                      std::min(size_px, int(std::floor(at_px + margin_px + 0.5)) + 1)};
    return range.begin < range.end ? range : Range{0, 0};
  };
  for (const int margin_px : {0, 1, 2})
    for (const double u_px :
         {-2.7, -2.3, -1.3, -0.7, -0.3, 0.2, 40.3, 40.7, 88.8, 89.3, 89.7, 90.7, 91.3, 91.7})
      for (const double v_px : {-2.7, -1.3, -0.3, 0.3, 30.7, 68.8, 69.3, 69.7, 71.3, 71.7}) {
        const Eigen::Vector3d center_m((u_px - k.cx_px) / k.fx_px, (v_px - k.cy_px) / k.fy_px, 1),
            half_m(kHalf_m, kHalf_m, 1e-6);
        const hull::ObjectPixels found =
            footprint({}, {center_m - half_m, center_m + half_m}, camera, margin_px);
        const Range u = expected(u_px, margin_px, kWidth_px),
                    v = expected(v_px, margin_px, kHeight_px);
        hull::PixelRect rect{u.begin, v.begin, u.end, v.end};
        if (rect.empty()) rect = {};
        EXPECT_EQ(found.bounds(), rect) << margin_px << ": " << u_px << ' ' << v_px;
        EXPECT_EQ(found.count(), rect.area_px()) << margin_px << ": " << u_px << ' ' << v_px;
      }
}

}  // namespace
}  // namespace fivepipe::capture
