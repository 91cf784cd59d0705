// The projection of a view's rays into a map, the half-spaces that bound the hull, and the pyramids
// of rectangles of pixels.
#include "common/hull/map_from_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/hull/image_cone.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/not_finite.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

geometry::Camera with_odd_pinhole(geometry::Camera camera) {
  camera.pinhole.fy_px *= 1.25;
  camera.pinhole.cx_px += 7;
  camera.pinhole.cy_px -= 4;
  return camera;
}

TEST(MapFromView, ProjectsThePointAtEachDepth) {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const geometry::Camera map_camera = with_odd_pinhole(random_camera(random, 160, 121)),
                           view = with_odd_pinhole(random_camera(random, 64, 48));
    const MapFromView map = map_from_view(map_camera, view);
    for (int k = 0; k < 20; ++k) {
      const Vector2d uv{uniform(random, -0.5, 63.5), uniform(random, -0.5, 47.5)};
      const double t = uniform(random, 0.1, 3);
      const geometry::Ray ray = geometry::ray_through(view, uv);
      const Vector3d p_map =
          map_camera.camera_from_world * Vector3d(ray.origin_world_m + t * ray.direction_world);
      const Vector3d at = map.at_eye + t * (map.at_infinity * Vector3d(uv.x(), uv.y(), 1));
      EXPECT_NEAR(at.z(), p_map.z(), 1e-12);
      const geometry::Pinhole& k_map = map_camera.pinhole;  // half a pixel is added
      EXPECT_NEAR(at.x(), k_map.fx_px * p_map.x() + (k_map.cx_px + 0.5) * p_map.z(), 1e-9);
      EXPECT_NEAR(at.y(), k_map.fy_px * p_map.y() + (k_map.cy_px + 0.5) * p_map.z(), 1e-9);
    }
  }
}

// Near one border at a time, a point in the half-spaces has a pixel in the bounds and is in front
// of the map's camera, and no other point is.
TEST(HalfSpaces, HoldExactlyThePointsInFrontOfTheBounds) {
  Random random(3);
  const PixelRect bounds{20, 30, 100, 90};
  int in = 0, out = 0;
  for (int i = 0; i < 30; ++i) {
    const geometry::Camera map_camera = random_camera(random, 160, 121),
                           view = random_camera(random, 64, 48);
    std::vector<HalfSpace> half_spaces;
    add_half_spaces(map_from_view(map_camera, view), bounds, half_spaces);
    ASSERT_EQ(half_spaces.size(), 5u);
    for (int k = 0; k < 200; ++k) {
      const double u = uniform(random, 0, 63), v = uniform(random, 0, 47),
                   t = uniform(random, 0.05, 4);
      const geometry::Ray ray = geometry::ray_through(view, {u, v});
      const auto uv =
          geometry::project(map_camera, Vector3d(ray.origin_world_m + t * ray.direction_world));
      const bool expected = uv && holds(bounds, uv->x(), uv->y());
      bool found = true;
      for (const HalfSpace& h : half_spaces) found &= h.offset + t * h.slope_at(u, v) >= 0;
      ASSERT_EQ(found, expected);
      (found ? in : out)++;
    }
  }
  EXPECT_GT(in, 300);
  EXPECT_GT(out, 300);
}

// Points nearer than 1e-9 m to the map's camera are ignored.
TEST(HalfSpaces, StartANanometreInFrontOfTheCamera) {
  const geometry::Camera camera{geometry::pinhole_from_fov(10, 8, 0.8),
                                Eigen::Isometry3d::Identity()};
  std::vector<HalfSpace> half_spaces;
  add_half_spaces(map_from_view(camera, camera), {0, 0, 10, 8}, half_spaces);
  const auto in_all = [&](double t) {
    for (const HalfSpace& h : half_spaces)
      if (!(h.offset + t * h.slope_at(4.5, 3.5) >= 0)) return false;
    return true;
  };
  EXPECT_TRUE(in_all(1.01e-9));
  EXPECT_FALSE(in_all(0.99e-9));
}

// Half-planes of the view at depth 1, given as pixels.
HalfSpace right_of(double u_px) { return {-u_px, {1, 0, 0}}; }
HalfSpace left_of(double u_px) { return {u_px, {-1, 0, 0}}; }
HalfSpace below(double v_px) { return {-v_px, {0, 1, 0}}; }
HalfSpace above(double v_px) { return {v_px, {0, -1, 0}}; }

TEST(PixelsAtDepth, AreTheBoundsAndOnePixelMore) {
  const PixelRect view{3, 4, 63, 44};
  EXPECT_EQ(pixels_at_depth({}, 1, view), view);
  EXPECT_EQ(pixels_at_depth({right_of(10.2)}, 1, view), (PixelRect{9, 4, 63, 44}));
  EXPECT_EQ(pixels_at_depth({right_of(10.6)}, 1, view), (PixelRect{10, 4, 63, 44}));
  EXPECT_EQ(pixels_at_depth({left_of(30.2)}, 1, view), (PixelRect{3, 4, 32, 44}));
  EXPECT_EQ(pixels_at_depth({below(10.2)}, 1, view), (PixelRect{3, 9, 63, 44}));
  EXPECT_EQ(pixels_at_depth({above(30.2)}, 1, view), (PixelRect{3, 4, 63, 32}));
  EXPECT_EQ(pixels_at_depth({right_of(10.2), left_of(30.2), below(12.2), above(20.2)}, 1, view),
            (PixelRect{9, 11, 32, 22}));
  // u + v <= 20 leaves a triangle at the view's corner (2.5, 3.5).
  EXPECT_EQ(pixels_at_depth({{20, {-1, -1, 0}}}, 1, view), (PixelRect{3, 4, 19, 20}));
  // At depth 2 the slope counts twice: u >= 20.4 / 2.
  EXPECT_EQ(pixels_at_depth({right_of(20.4)}, 2, view), (PixelRect{9, 4, 63, 44}));
  EXPECT_EQ(pixels_at_depth({{1, {0, 0, -2}}}, 0.25, view), view);
  EXPECT_EQ(pixels_at_depth({{1, {0, 0, -2}}}, 0.75, view), PixelRect{});
}

// The corners of the view are in half-spaces that end at its borders.
TEST(PixelsAtDepth, AreAllIfTheHalfSpacesEndAtTheViewsBorders) {
  const PixelRect view{3, 4, 63, 44};
  for (const HalfSpace& h : {right_of(2.5), left_of(62.5), below(3.5), above(43.5)})
    EXPECT_EQ(pixels_at_depth({h}, 1, view), view);
  EXPECT_EQ(pixels_at_depth({right_of(2.5), left_of(62.5), below(3.5), above(43.5)}, 1, view),
            view);
  EXPECT_EQ(pixels_at_depth({left_of(2.5)}, 1, view), (PixelRect{3, 4, 5, 44}));
}

TEST(PixelsAtDepth, AreNoneIfTheHalfSpacesDoNotMeetInTheView) {
  const PixelRect view{3, 4, 63, 44};
  EXPECT_EQ(pixels_at_depth({right_of(63)}, 1, view), PixelRect{});
  EXPECT_EQ(pixels_at_depth({right_of(30), left_of(29.9), below(10)}, 1, view), PixelRect{});
  EXPECT_FALSE(pixels_at_depth({right_of(30), left_of(30)}, 1, view).empty());  // a line
}

TEST(Camera, IsFiniteWithFiniteParametersAndPositiveFocalLengths) {
  const geometry::Camera good{{10, 8, 9, 9, 0, -3}, Eigen::Isometry3d::Identity()};
  EXPECT_TRUE(is_finite(good));
  for (double geometry::Pinhole::*parameter :
       {&geometry::Pinhole::fx_px, &geometry::Pinhole::fy_px, &geometry::Pinhole::cx_px,
        &geometry::Pinhole::cy_px})
    for (const double value : {kNaN, kInfinity, -kInfinity}) {
      geometry::Camera bad = good;
      bad.pinhole.*parameter = value;
      EXPECT_FALSE(is_finite(bad)) << value;
    }
  for (double geometry::Pinhole::*focal : {&geometry::Pinhole::fx_px, &geometry::Pinhole::fy_px}) {
    for (const double value : {0.0, -1.0}) {
      geometry::Camera bad = good;
      bad.pinhole.*focal = value;
      EXPECT_FALSE(is_finite(bad)) << value;
    }
    geometry::Camera short_focal = good;
    short_focal.pinhole.*focal = 0.25;
    EXPECT_TRUE(is_finite(short_focal));
  }
  for (int i = 0; i < 12; ++i) {
    geometry::Camera bad = good;
    bad.camera_from_world.matrix()(i % 3, i / 3) = kNaN;
    EXPECT_FALSE(is_finite(bad)) << i;
  }
}

// Closed form: a camera of focal length 100 at the origin, and the pyramid of the pixels whose
// borders are at x / z = -0.3 and 0.4, y / z = -0.2 and 0.1.
TEST(ImageCone, DistancesToThePyramidsBorderAreTheClosedForm) {
  const geometry::Camera camera{{200, 200, 100, 100, 99.5, 99.5}, Eigen::Isometry3d::Identity()};
  const ImageCone cone(camera);
  const Pyramid pyramid = cone.pyramid({70, 80, 140, 110});
  const auto distance = [](double slope, double across,
                           double z) {  // to the plane across = slope z
    return (slope * z - across) / std::hypot(1, slope);
  };
  Random random(4);
  int in = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector3d p{uniform(random, -1, 1), uniform(random, -0.5, 0.5), uniform(random, -1, 3)};
    const double nearest = std::min({-distance(-0.3, p.x(), p.z()), distance(0.4, p.x(), p.z()),
                                     -distance(-0.2, p.y(), p.z()), distance(0.1, p.y(), p.z())});
    const ProjectedPoint at = cone.see(p);
    EXPECT_NEAR(cone.inside_m(at, pyramid), nearest, 1e-12);
    EXPECT_NEAR(cone.outside_m(at, pyramid), -std::min(nearest, p.z()), 1e-12);
    EXPECT_LT(cone.inside_m(at, pyramid), nearest);  // lower bounds
    EXPECT_LT(cone.outside_m(at, pyramid), -std::min(nearest, p.z()));
    in += nearest > 0;
  }
  EXPECT_GT(in, 30);
}

TEST(ImageCone, SeesThePixelAndBoundsRoundingBy64Epsilons) {
  geometry::Camera camera{{200, 200, 100, 50, 300, 40},
                          geometry::look_at({0.5, -2, 1}, {0.1, 0, 0})};
  const Vector3d p(0.25, -0.5, 0.75);
  const ProjectedPoint at = ImageCone(camera).see(p);
  const auto uv = geometry::project(camera, p);
  EXPECT_NEAR(at.u_px, uv->x(), 1e-9);
  EXPECT_NEAR(at.v_px, uv->y(), 1e-9);
  EXPECT_TRUE(at.p_camera_m.isApprox(camera.camera_from_world * p, 1e-15));
  const double epsilons = 64 * std::numeric_limits<double>::epsilon(),
               lengths_m = 1.5 + camera.camera_from_world.translation().lpNorm<1>();
  EXPECT_NEAR(at.rounding_m, epsilons * (2 + 300.0 / 100) * lengths_m, 1e-6 * at.rounding_m);
  camera.pinhole.cy_px = -400;
  EXPECT_NEAR(ImageCone(camera).see(p).rounding_m, epsilons * (2 + 400.0 / 50) * lengths_m,
              1e-6 * epsilons);
}

// A "rotation" that doubles one axis: distances in the world are at least half of those in the
// camera's frame.
TEST(ImageCone, DividesDistancesByTheLargestStretch) {
  geometry::Camera camera{{200, 200, 100, 100, 99.5, 99.5}, Eigen::Isometry3d::Identity()};
  const PixelRect rect{70, 80, 140, 110};
  const ImageCone plain(camera);
  camera.camera_from_world.linear()(1, 1) = 2;
  const ImageCone stretched(camera);
  const Vector3d p(0.1, 0, 2);
  EXPECT_NEAR(stretched.inside_m(stretched.see(p), stretched.pyramid(rect)),
              0.5 * plain.inside_m(plain.see(p), plain.pyramid(rect)), 1e-12);
  const Vector3d q(1, 0, 0.5);
  EXPECT_NEAR(stretched.outside_m(stretched.see(q), stretched.pyramid(rect)),
              0.5 * plain.outside_m(plain.see(q), plain.pyramid(rect)), 1e-12);
}

TEST(PixelRects, HoldTheHalfOpenSquaresOfTheirPixels) {
  const geometry::Camera camera{{10, 8, 9, 9, 0, 0}, Eigen::Isometry3d::Identity()};
  EXPECT_EQ(image_of(camera), (PixelRect{0, 0, 10, 8}));
  const PixelRect rect{2, 3, 7, 5};
  EXPECT_TRUE(holds(rect, 1.5, 2.5) && holds(rect, 6.4999, 4.4999));
  EXPECT_FALSE(holds(rect, 1.4999, 3) || holds(rect, 6.5, 3) || holds(rect, 3, 2.4999) ||
               holds(rect, 3, 4.5) || holds(rect, std::nan(""), 3) || holds(rect, 3, std::nan("")));
}

TEST(Defaults, AreTheDocumentedValues) {
  EXPECT_EQ(HullRule{}.limits, Limits::all);
  EXPECT_EQ(HullRule{}.min_seen, 2);
  EXPECT_EQ(View{}.near_m, 0.05);
  EXPECT_EQ(View{}.far_m, 10.0);
  EXPECT_EQ(kNearestToCamera_m, 1e-9);
}

}  // namespace
}  // namespace fivepipe::hull
