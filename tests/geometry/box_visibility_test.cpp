#include "common/geometry/box_visibility.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

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

TEST(BoxVisibility, ABoxThatTouchesTheLeftOrTheUpperEdgeOfTheImageIsVisible) {
  // The view is |x| <= z and |y| <= z. A double holds the touching edges exactly.
  const Camera camera{{2, 2, 1, 1, 0.5, 0.5}};
  const auto is_visible = [&](const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) {
    return is_box_visible(camera, Eigen::AlignedBox3d(min_m, max_m));
  };
  EXPECT_TRUE(is_visible({-3, 0, 0.5}, {-1, 0.25, 1}));
  EXPECT_TRUE(is_visible({0, -3, 0.5}, {0.25, -1, 1}));
  EXPECT_FALSE(is_visible({0, -3, 0.5}, {0.25, -1.001, 1}));
}

// normal . p + offset_m >= 0, with a normal of length 1.
struct HalfSpace {
  Eigen::Vector3d normal;
  double offset_m;
};

// Returns the box and the view, each side `by_m` further out. The planes of the view contain the
// rays through two corners of the image.
std::vector<HalfSpace> half_spaces(const Camera& camera, const Eigen::AlignedBox3d& box_world_m,
                                   double by_m) {
  std::vector<HalfSpace> sides;
  for (int axis = 0; axis < 3; ++axis) {
    sides.push_back({Eigen::Vector3d::Unit(axis), by_m - box_world_m.min()[axis]});
    sides.push_back({-Eigen::Vector3d::Unit(axis), by_m + box_world_m.max()[axis]});
  }
  const double right_px = camera.pinhole.width_px - 0.5, bottom_px = camera.pinhole.height_px - 0.5;
  const Eigen::Vector2d corners_px[] = {
      {-0.5, -0.5}, {right_px, -0.5}, {right_px, bottom_px}, {-0.5, bottom_px}};
  for (int i = 0; i < 4; ++i) {
    const Ray a = ray_through(camera, corners_px[i]),
              b = ray_through(camera, corners_px[(i + 1) % 4]);
    const Eigen::Vector3d normal = a.direction_world.cross(b.direction_world).normalized();
    sides.push_back({normal, by_m - normal.dot(a.origin_world_m)});
  }
  return sides;
}

// A bounded intersection of half-spaces that is not empty has a vertex on three of their planes.
bool intersect(const std::vector<HalfSpace>& sides) {
  const auto contains = [&](const Eigen::Vector3d& p) {
    return std::all_of(sides.begin(), sides.end(), [&](const HalfSpace& side) {
      return side.normal.dot(p) + side.offset_m >= -1e-9;
    });
  };
  for (std::size_t i = 0; i < sides.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      for (std::size_t k = 0; k < j; ++k) {
        Eigen::Matrix3d normals;
        normals << sides[i].normal, sides[j].normal, sides[k].normal;
        if (std::abs(normals.determinant()) < 1e-12) continue;
        const Eigen::Vector3d offsets_m(sides[i].offset_m, sides[j].offset_m, sides[k].offset_m);
        if (contains(-(normals.transpose().inverse() * offsets_m))) return true;
      }
  return false;
}

TEST(BoxVisibility, EqualsTheIntersectionOfHalfSpaces) {
  constexpr double kMargin_m = 1e-5;
  std::mt19937 random(1);
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const auto vector = [&](double a) {
    return Eigen::Vector3d{between(-a, a), between(-a, a), between(-a, a)};
  };
  int visible = 0, hidden = 0;
  for (int i = 0; i < 1500; ++i) {
    const Eigen::Vector3d center_m = vector(0.5), half_m = vector(0.6).cwiseAbs();
    const Eigen::AlignedBox3d box_m(center_m - half_m, center_m + half_m);
    const double size_px = i % 2 ? 700 : 4;  // in a small image, half a pixel is a large part
    const double focal_px = size_px * std::exp(between(-2, 3));
    const Pinhole k{int(between(1, size_px)),
                    int(between(1, size_px)),
                    focal_px,
                    focal_px * between(0.5, 2),
                    between(-0.2 * size_px, size_px),
                    between(-0.2 * size_px, size_px)};
    const Eigen::Vector3d eye_m = vector(2), target_m = eye_m + vector(1);
    const Camera camera{k, look_at(eye_m, target_m, vector(1))};
    if (intersect(half_spaces(camera, box_m, -kMargin_m))) {
      ++visible;
      ASSERT_TRUE(is_box_visible(camera, box_m)) << i;
    } else if (!intersect(half_spaces(camera, box_m, kMargin_m))) {
      ++hidden;
      ASSERT_FALSE(is_box_visible(camera, box_m)) << i;
    }
  }
  EXPECT_GT(visible, 100);
  EXPECT_GT(hidden, 300);
}

}  // namespace
}  // namespace fivepipe::geometry
