#include "common/geometry/box_visibility.h"

#include <gtest/gtest.h>

namespace fivepipe::geometry {
namespace {

// A narrow view of the box passes between the points of any sampling grid, so is_box_visible must
// be exact.
TEST(BoxVisibility, IsExactForNarrowAndWideViewsAndCamerasInsideTheBox) {
  const Eigen::AlignedBox3d box_m(Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(1, 1, 1));
  const Pinhole telescope{720, 486, 50000, 50000, 359.5, 242.5},
      fisheye_like{720, 486, 50, 50, 359.5, 242.5};
  EXPECT_TRUE(is_box_visible({telescope, look_at({3, 0.123, 0.456}, {0, 0.1234, 0.4567})}, box_m));
  EXPECT_FALSE(is_box_visible({telescope, look_at({3, 0, 0.5}, {0, 3, 0.5})}, box_m))
      << "the view passes the box";
  EXPECT_TRUE(is_box_visible({fisheye_like, look_at({3, 0, 0.5}, {3, 3, 0.5})}, box_m))
      << "164 degrees wide: the box is at the edge of the image";
  EXPECT_TRUE(is_box_visible({telescope, look_at({0, 0, 0.5}, {1, 0, 0.5})}, box_m))
      << "the camera is inside the box";
  EXPECT_FALSE(is_box_visible({fisheye_like, look_at({3, 0, 0.5}, {6, 0, 0.5})}, box_m))
      << "the box is behind the camera";
}

}  // namespace
}  // namespace fivepipe::geometry
