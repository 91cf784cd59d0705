// Compositing by depth: occlusion, position and interpolation of the hull, poses.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/render/composite_fixture.h"

namespace fivepipe::render {
namespace {

// A plate is at 0.8 m, a larger rectangle of hull at 1 m, a still larger plate at 1.2 m. Each pixel
// shows the nearest surface.
TEST_F(Composite, RealAndVirtualOccludeEachOtherPerPixel) {
  const geometry::Pinhole k = config::render_pinhole(viewer_),
                          recon = config::recon_pinhole(viewer_);
  const double near_half_m = 0.1, far_half_m = 0.4;
  Renderer renderer(scene_of({plate("near", 0.8, 2 * near_half_m, 2 * near_half_m),
                              plate("far", 1.2, 2 * far_half_m, 2 * far_half_m)}),
                    viewer_);
  const HullFrame hull = test::hull_of(eye_, recon, &kHullBgr, [](int u, int v) {
    return u >= 80 && u < 240 && v >= 60 && v < 180 ? 1.0f : hull::kNoHull;
  });
  renderer.draw(hull, {}, {});
  const cv::Mat image = renderer.image_bgr(), depth_m = renderer.depth_m();
  const auto on_plate = [&](int u, int v, double front_m, double half_m) {
    return std::abs((u - k.cx_px) / k.fx_px * front_m) < half_m &&
           std::abs((v - k.cy_px) / k.fy_px * front_m) < half_m;
  };
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      const bool in_hull = u >= 160 && u < 480 && v >= 120 && v < 360;
      const float expected_m = on_plate(u, v, 0.8, near_half_m)  ? 0.8f
                               : in_hull                         ? 1.0f
                               : on_plate(u, v, 1.2, far_half_m) ? 1.2f
                                                                 : 5.0f;
      ASSERT_NEAR(depth_m.at<float>(v, u), expected_m, kDepthRounding_m) << u << ' ' << v;
      ASSERT_EQ(image.at<cv::Vec3b>(v, u) == kHullColour, expected_m == 1.0f) << u << ' ' << v;
    }
}

// A plate of 0.9 pixels covers the centre of one pixel only. A shift by half a pixel would hide it
// or show another pixel.
TEST_F(Composite, PointRendersAtItsProjectedPixel) {
  const geometry::Camera camera{config::render_pinhole(viewer_), eye_};
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) {
    const int u = int(random() % 640), v = int(random() % 480);
    const double depth_m = 0.3 + 0.1 * double(random() % 30),
                 size_m = 0.9 * depth_m / camera.pinhole.fx_px;
    const geometry::Ray ray = geometry::ray_through(camera, Eigen::Vector2d(u, v));
    const Eigen::Vector3d p_world_m = ray.origin_world_m + depth_m * ray.direction_world;
    ASSERT_NEAR((*geometry::project(camera, p_world_m) - Eigen::Vector2d(u, v)).norm(), 0, 1e-9);
    config::SceneObject point =
        test::object("point", config::BoxShape{{size_m, 1e-6, size_m}}, p_world_m, {1, 1, 1});
    Renderer renderer(scene_of({point}), viewer_);
    renderer.draw(empty_hull_, {}, {});
    const cv::Mat depth = renderer.depth_m();
    EXPECT_EQ(cv::countNonZero(depth < 4.9f), 1) << u << ' ' << v;
    EXPECT_NEAR(depth.at<float>(v, u), depth_m, kDepthRounding_m) << u << ' ' << v;
  }
}

// Tests full size and half size; the paper uses half size.
TEST_F(Composite, ReconstructionPixelCoversItsRenderPixels) {
  for (const int scale : {1, 2}) {
    viewer_.recon_width_px = 640 / scale;
    viewer_.recon_height_px = 480 / scale;
    Renderer renderer(scene_of({}), viewer_);
    std::vector<std::pair<int, int>> pixels = {
        {0, 0}, {640 / scale - 1, 480 / scale - 1}, {101, 57}, {0, 200}};
    for (const auto& [hit_u, hit_v] : pixels) {
      renderer.draw(test::hull_of(eye_, config::recon_pinhole(viewer_), &kHullBgr,
                                  [&, u0 = hit_u, v0 = hit_v](int u, int v) {
                                    return u == u0 && v == v0 ? 1.0f : hull::kNoHull;
                                  }),
                    {}, {});
      const cv::Mat image = renderer.image_bgr();
      for (int v = 0; v < 480; ++v)
        for (int u = 0; u < 640; ++u)
          ASSERT_EQ(image.at<cv::Vec3b>(v, u) == kHullColour,
                    u / scale == hit_u && v / scale == hit_v)
              << u << ' ' << v;
    }
  }
}

// Interpolation between the reconstruction's pixels keeps a plane: 1 / z is linear in the image.
TEST_F(Composite, ATiltedPlaneIsInterpolatedExactly) {
  const geometry::Pinhole k = config::render_pinhole(viewer_),
                          recon = config::recon_pinhole(viewer_);
  const auto inverse_depth = [](const geometry::Pinhole& p, int u, int v) {
    return 1 + 0.5 * (u - p.cx_px) / p.fx_px - 0.3 * (v - p.cy_px) / p.fy_px;
  };
  Renderer renderer(scene_of({}), viewer_);
  renderer.draw(test::hull_of(eye_, recon, &kHullBgr,
                              [&](int u, int v) { return 1 / inverse_depth(recon, u, v); }),
                {}, {});
  const cv::Mat depth_m = renderer.depth_m();
  for (int v = 2; v < 478; ++v)
    for (int u = 2; u < 638; ++u)
      ASSERT_NEAR(depth_m.at<float>(v, u), 1 / inverse_depth(k, u, v), kDepthRounding_m)
          << u << ' ' << v;
}

TEST_F(Composite, NothingIsInterpolatedAcrossASilhouette) {
  Renderer renderer(scene_of({}), viewer_);
  renderer.draw(test::hull_of(eye_, config::recon_pinhole(viewer_), &kHullBgr,
                              [](int u, int v) {
                                return (u + v) % 7 < 3 ? 0.8f : u % 5 == 0 ? hull::kNoHull : 1.2f;
                              }),
                {}, {});
  const cv::Mat depth_m = renderer.depth_m();
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      const float z = depth_m.at<float>(v, u);
      ASSERT_LT(std::min({std::abs(z - 0.8f), std::abs(z - 1.2f), std::abs(z - 5.0f)}),
                kDepthRounding_m)
          << u << ' ' << v << ": " << z;
    }
}

TEST_F(Composite, ASmallerHullLeavesNoTraceOfThePreviousFrame) {
  const geometry::Pinhole recon = config::recon_pinhole(viewer_);
  Renderer renderer(scene_of({}), viewer_);
  renderer.draw(test::hull_of(eye_, recon, &kHullBgr, [](int, int) { return 0.9f; }), {}, {});
  const auto small = test::hull_of(eye_, recon, &kHullBgr, [](int u, int v) {
    return (u - 100) * (u - 100) + (v - 90) * (v - 90) < 400 ? 1.0f : hull::kNoHull;
  });
  renderer.draw(small, {}, {});
  const cv::Mat after = renderer.image_bgr();
  EXPECT_EQ(cv::norm(after, image(scene_of({}), small), cv::NORM_INF), 0);
  renderer.draw(empty_hull_, {}, {});
  EXPECT_EQ(cv::norm(renderer.image_bgr(), image(scene_of({}), empty_hull_), cv::NORM_INF), 0);
}

TEST_F(Composite, AnEmptyHullShowsOnlyTheVirtualScene) {
  const config::Scene scene = scene_of({plate("plate", 1, 0.4, 0.4)});
  HullFrame empty = test::hull_of(eye_, config::recon_pinhole(viewer_), &kHullBgr,
                                  [](int, int) { return hull::kNoHull; });
  EXPECT_EQ(cv::norm(image(scene, empty), image(scene, empty_hull_), cv::NORM_INF), 0);
}

TEST_F(Composite, HullAtNearAndFarPlaneIsDepthTested) {
  const config::Scene scene = scene_of({plate("plate", 0.06, 0.01, 0.01)});
  const auto count = [&](float z) {
    const cv::Mat drawn = image(scene, test::hull_of(eye_, config::recon_pinhole(viewer_),
                                                     &kHullBgr, [&](int, int) { return z; }));
    return std::count(drawn.begin<cv::Vec3b>(), drawn.end<cv::Vec3b>(), kHullColour);
  };
  EXPECT_EQ(count(float(viewer_.near_m)), 640 * 480);
  // The plate covers a square of 0.01 / 0.06 * fx pixels, within one row on each side.
  const double plate_px = 0.01 / 0.06 * config::render_pinhole(viewer_).fx_px;
  EXPECT_NEAR(double(640 * 480 - count(float(viewer_.far_m))), plate_px * plate_px, 4 * plate_px);
}

TEST_F(Composite, AnObjectAroundTheEyeShowsItsBackFaces) {
  const config::Scene scene =
      scene_of({test::object("room", config::BoxShape{{2, 2, 2}}, {0, 0, 0}, {0.8, 0.8, 0.8})},
               {0.3, -0.5, 0.5});
  Renderer renderer(scene, viewer_);
  renderer.draw(empty_hull_, {}, {});
  EXPECT_NEAR(renderer.depth_m().at<float>(240, 320), 1, kDepthRounding_m);
  EXPECT_GT(brightness(renderer.image_bgr().at<cv::Vec3b>(240, 320)), 150);
}

TEST_F(Composite, AnObjectAroundTheNearPlaneShowsItsBackFaces) {
  Renderer renderer(scene_of({test::object("box", config::BoxShape{{0.5, 0.5, 0.5}}, {0, 0.2, 0},
                                           {0.8, 0.8, 0.8})}),
                    viewer_);
  renderer.draw(empty_hull_, {}, {});
  EXPECT_NEAR(renderer.depth_m().at<float>(240, 320), 0.45, kDepthRounding_m);
}

// The eye is outside the box, but the near plane cuts the box: straight ahead, and in a corner of
// the view. In a corner, the near plane is farther from the eye.
TEST_F(Composite, AnObjectCutByTheNearPlaneShowsItsBackFaces) {
  const auto depth_of = [&](const Eigen::Vector3d& min_m, int u, int v) {
    const double side_m = 0.5;
    Renderer renderer(
        scene_of({test::object("box", config::BoxShape{{side_m, side_m, side_m}},
                               min_m + Eigen::Vector3d::Constant(side_m / 2), {0.8, 0.8, 0.8})}),
        viewer_);
    renderer.draw(empty_hull_, {}, {});
    return renderer.depth_m().at<float>(v, u);
  };
  EXPECT_NEAR(depth_of({-0.25, 0.02, -0.25}, 320, 240), 0.52, kDepthRounding_m);
  const geometry::Pinhole k = config::render_pinhole(viewer_);
  const Eigen::Vector2d direction((630 - k.cx_px) / k.fx_px,
                                  -(10 - k.cy_px) / k.fy_px);  // up to the right
  const Eigen::Vector3d corner_m(0.9 * 0.05 * direction.x(), 0.047, 0.9 * 0.05 * direction.y());
  ASSERT_GT(corner_m.norm(), viewer_.near_m);
  EXPECT_NEAR(depth_of(corner_m, 630, 10), 0.547, kDepthRounding_m);
  EXPECT_NEAR(depth_of({-0.25, 0.06, -0.25}, 320, 240), 0.06, kDepthRounding_m);
}

// The front of each object is 1 m away. The object whose bounding sphere ends farther away shows,
// because a floor or a wall is drawn last. The numbers are exact in binary.
TEST_F(Composite, OfTwoSurfacesAtTheSameDepthThatOfTheLargerObjectShows) {
  constexpr double kThickness_m = 1 / 1024.0, kCube_m = 0.125;
  const config::SceneObject cube =  // its sphere ends at 1.17 m
      test::object("cube", config::BoxShape{{kCube_m, kCube_m, kCube_m}}, {0, 1 + kCube_m / 2, 0},
                   {0.9, 0.1, 0.1});
  for (const auto& [width_m, is_larger] : {std::pair{0.21875, false}, {0.3125, true}}) {
    const config::SceneObject plate =  // its sphere ends at 1.15 m or at 1.22 m
        test::object("plate", config::BoxShape{{width_m, kThickness_m, width_m}},
                     {0, 1 + kThickness_m / 2, 0}, {0.1, 0.1, 0.9});
    const cv::Mat drawn = image(scene_of({cube, plate}), empty_hull_);
    const cv::Vec3b bgr = drawn.at<cv::Vec3b>(236, 323);
    EXPECT_EQ(bgr[0] > bgr[2], is_larger) << bgr;
    EXPECT_EQ(cv::norm(drawn, image(scene_of({plate, cube}), empty_hull_), cv::NORM_INF), 0)
        << "depends on the order of the objects";
  }
}

TEST_F(Composite, AnObjectKeepsItsLastPose) {
  Renderer renderer(scene_of({plate("plate", 1, 0.1, 0.1)}), viewer_);
  ObjectPose moved{"plate", Eigen::Isometry3d::Identity(), {}, {}};
  moved.world_from_object.translation() = Eigen::Vector3d(0.3, 2, 0);
  const auto depth_at = [&](double x_m, double y_m) {
    const auto uv = geometry::project({config::render_pinhole(viewer_), eye_}, {x_m, y_m, 0});
    return renderer.depth_m().at<float>(int(std::lround(uv->y())), int(std::lround(uv->x())));
  };
  ASSERT_FALSE(renderer.why_undrawable(moved));
  renderer.draw(empty_hull_, std::vector{moved}, {});
  EXPECT_NEAR(depth_at(0.3, 2), 2, 2e-3);
  EXPECT_NEAR(depth_at(0, 1), 5, 2e-3);
  renderer.draw(empty_hull_, {}, {});
  EXPECT_NEAR(depth_at(0.3, 2), 2, 2e-3);
}

TEST_F(Composite, NamesWhyAPoseIsUndrawable) {
  const config::SceneObject curtain = test::object(
      "curtain", config::CurtainShape{0.6, 0.6, 2, 2, 0, 1}, {0, 1, 0.3}, {0.8, 0.8, 0.8});
  const Renderer renderer(scene_of({curtain}), viewer_);
  const ObjectPose good{"curtain", curtain.world_from_object, std::vector<float>(27, 0.1f), {}};
  EXPECT_EQ(renderer.why_undrawable(good), std::nullopt);
  std::vector<ObjectPose> bad(4, good);
  bad[0].object = "curtian";
  bad[1].vertices_m.pop_back();
  bad[2].vertices_m[5] = std::numeric_limits<float>::quiet_NaN();
  bad[3].world_from_object.translation().z() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(renderer.why_undrawable(bad[0]), "not in the scene");
  EXPECT_EQ(renderer.why_undrawable(bad[1]), "26 vertex coordinates for a mesh of 9 vertices");
  EXPECT_EQ(renderer.why_undrawable(bad[2]), "vertex not finite");
  EXPECT_EQ(renderer.why_undrawable(bad[3]), "pose not finite");
}

TEST_F(Composite, RenderingIsInvariantUnderTranslation) {
  const Eigen::Vector3d far_away_m(1000, -700, 300);
  const auto ball = [](const Eigen::Vector3d& at_m) {
    return test::object("ball", config::SphereShape{0.2, 3}, at_m, {0.8, 0.5, 0.2});
  };
  const cv::Mat here = image(scene_of({ball({0, 1, 0})}, {-1, 0, 1}), empty_hull_);
  empty_hull_.eye_from_world = geometry::look_at(far_away_m, far_away_m + Eigen::Vector3d::UnitY());
  const cv::Mat there = image(scene_of({ball(far_away_m + Eigen::Vector3d(0, 1, 0))},
                                       far_away_m + Eigen::Vector3d(-1, 0, 1)),
                              empty_hull_);
  cv::Mat difference;
  cv::absdiff(here, there, difference);
  // A few pixels at the border of the ball may differ.
  EXPECT_LT(cv::mean(difference)[0], 0.05);
}

}  // namespace
}  // namespace fivepipe::render
