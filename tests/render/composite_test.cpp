#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <random>

#include "common/gl/context.h"
#include "render_node/renderer.h"
#include "tests/support/render_scenes.h"

namespace fivepipe::render {
namespace {

// Window depth is a float: half a unit in the last place at 1 is 3e-8; near / z^2 carries it to
// metres, 1.5e-5 m at 5 m behind a near plane of 5 cm. The vertices' own rounding in clip space is
// of the same size.
constexpr float kDepthRounding_m = 1e-4f;

const std::array<std::uint8_t, 3> kHullBgr = {10, 200, 90};
const cv::Vec3b kHullColour(10, 200, 90);

config::Viewer viewer(double near_m = 0.05, double far_m = 5.0) {
  config::Viewer v;
  v.near_m = near_m;
  v.far_m = far_m;
  return v;
}

config::Scene scene_of(std::vector<config::SceneObject> objects,
                       const Eigen::Vector3d& light_world_m = {0, -1, 2}) {
  config::Scene scene;
  scene.objects = std::move(objects);
  scene.light_world_m = light_world_m;
  return scene;
}

// A thin plate facing the eye of eye_along_y(), its front at depth_m.
config::SceneObject plate(const std::string& name, double depth_m, double width_m, double height_m,
                          double x_m = 0, double z_m = 0) {
  constexpr double kThickness_m = 1e-3;
  return test::object(name, config::BoxShape{{width_m, kThickness_m, height_m}},
                      {x_m, depth_m + kThickness_m / 2, z_m}, {0.8, 0.8, 0.8});
}

class Composite : public testing::Test {
 protected:
  gl::GlContext context_;
  config::Viewer viewer_ = viewer();
  Eigen::Isometry3d eye_ = test::eye_along_y();
  HullFrame nothing_ = test::no_hull(eye_, config::recon_pinhole(viewer_));

  cv::Mat image(const config::Scene& scene, const HullFrame& hull,
                const std::set<std::string>& colliding = {}) const {
    Renderer renderer(scene, viewer_);
    EXPECT_TRUE(renderer.draw(hull, {}, colliding).empty());
    return renderer.image_bgr();
  }
};

int brightness(const cv::Vec3b& bgr) { return bgr[0] + bgr[1] + bgr[2]; }

// A box at 0.8 m inside, the hull's rectangle at 1 m around it, a box at 1.2 m around both: each
// pixel shows what is nearest there.
TEST_F(Composite, RealAndVirtualOccludeEachOtherPixelByPixel) {
  const geometry::Pinhole k = config::render_pinhole(viewer_),
                          recon = config::recon_pinhole(viewer_);
  const double near_half_m = 0.1, far_half_m = 0.4;
  Renderer renderer(scene_of({plate("near", 0.8, 2 * near_half_m, 2 * near_half_m),
                              plate("far", 1.2, 2 * far_half_m, 2 * far_half_m)}),
                    viewer_);
  const HullFrame hull = test::hull_of(eye_, recon, &kHullBgr, [](int u, int v) {
    return u >= 80 && u < 240 && v >= 60 && v < 180 ? 1.0f : hull::kNoHull;
  });
  ASSERT_TRUE(renderer.draw(hull, {}, {}).empty());
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

// A plate of 0.9 pixels covers the centre of that one pixel alone; half a pixel's shift would lose
// it or show another.
TEST_F(Composite, PointRendersAtProjectedPixel) {
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
    renderer.draw(nothing_, {}, {});
    const cv::Mat depth = renderer.depth_m();
    EXPECT_EQ(cv::countNonZero(depth < 4.9f), 1) << u << ' ' << v;
    EXPECT_NEAR(depth.at<float>(v, u), depth_m, kDepthRounding_m) << u << ' ' << v;
  }
}

// Both at the paper's half size and at full size.
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

// Between the reconstruction's pixels a plane stays a plane: 1 / z is linear in the image.
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

// The last frame's hull leaves nothing behind where the next one is smaller.
TEST_F(Composite, AShrinkingHullLeavesNoTrace) {
  const geometry::Pinhole recon = config::recon_pinhole(viewer_);
  Renderer renderer(scene_of({}), viewer_);
  renderer.draw(test::hull_of(eye_, recon, &kHullBgr, [](int, int) { return 0.9f; }), {}, {});
  const auto small = test::hull_of(eye_, recon, &kHullBgr, [](int u, int v) {
    return (u - 100) * (u - 100) + (v - 90) * (v - 90) < 400 ? 1.0f : hull::kNoHull;
  });
  renderer.draw(small, {}, {});
  const cv::Mat after = renderer.image_bgr();
  EXPECT_EQ(cv::norm(after, image(scene_of({}), small), cv::NORM_INF), 0);
  renderer.draw(nothing_, {}, {});
  EXPECT_EQ(cv::norm(renderer.image_bgr(), image(scene_of({}), nothing_), cv::NORM_INF), 0);
}

TEST_F(Composite, AnEmptyHullIsTheVirtualSceneAlone) {
  const config::Scene scene = scene_of({plate("plate", 1, 0.4, 0.4)});
  HullFrame empty = test::hull_of(eye_, config::recon_pinhole(viewer_), &kHullBgr,
                                  [](int, int) { return hull::kNoHull; });
  EXPECT_EQ(cv::norm(image(scene, empty), image(scene, nothing_), cv::NORM_INF), 0);
}

TEST_F(Composite, HullAtNearAndFarPlaneIsDepthTested) {
  const config::Scene scene = scene_of({plate("plate", 0.06, 0.01, 0.01)});
  const auto count = [&](float z) {
    const cv::Mat drawn = image(scene, test::hull_of(eye_, config::recon_pinhole(viewer_),
                                                     &kHullBgr, [&](int, int) { return z; }));
    return std::count(drawn.begin<cv::Vec3b>(), drawn.end<cv::Vec3b>(), kHullColour);
  };
  EXPECT_EQ(count(float(viewer_.near_m)), 640 * 480);
  // The plate covers 0.01 / 0.06 * fx pixels square, to within a row on either side.
  const double plate_px = 0.01 / 0.06 * config::render_pinhole(viewer_).fx_px;
  EXPECT_NEAR(double(640 * 480 - count(float(viewer_.far_m))), plate_px * plate_px, 4 * plate_px);
}

TEST_F(Composite, ObjectAroundEyeShowsBackFaces) {
  const config::Scene scene =
      scene_of({test::object("room", config::BoxShape{{2, 2, 2}}, {0, 0, 0}, {0.8, 0.8, 0.8})},
               {0.3, -0.5, 0.5});
  Renderer renderer(scene, viewer_);
  renderer.draw(nothing_, {}, {});
  EXPECT_NEAR(renderer.depth_m().at<float>(240, 320), 1, kDepthRounding_m);
  EXPECT_GT(brightness(renderer.image_bgr().at<cv::Vec3b>(240, 320)), 150);
}

// Half a metre before the wall, and half a metre behind it.
TEST_F(Composite, AWallSeenFromInsideIsLitFromInside) {
  const auto wall_brightness = [&](double light_y_m) {
    return brightness(image(scene_of({test::object("room", config::BoxShape{{2, 2, 2}}, {0, 0, 0},
                                                   {0.8, 0.8, 0.8})},
                                     {0, light_y_m, 0}),
                            nothing_)
                          .at<cv::Vec3b>(240, 320));
  };
  EXPECT_GT(wall_brightness(0.5), wall_brightness(1.5) + 150);
}

TEST_F(Composite, AnObjectCutByTheNearPlaneShowsItsBack) {
  Renderer renderer(scene_of({test::object("box", config::BoxShape{{0.5, 0.5, 0.5}}, {0, 0.2, 0},
                                           {0.8, 0.8, 0.8})}),
                    viewer_);
  renderer.draw(nothing_, {}, {});
  EXPECT_NEAR(renderer.depth_m().at<float>(240, 320), 0.45, kDepthRounding_m);
}

// The eye is outside, the near plane is not: straight ahead, and in a corner of the view, where the
// near plane is farther from the eye.
TEST_F(Composite, NearClippedObjectShowsBackFaces) {
  const auto depth_of = [&](const Eigen::Vector3d& min_m, int u, int v) {
    const double side_m = 0.5;
    Renderer renderer(
        scene_of({test::object("box", config::BoxShape{{side_m, side_m, side_m}},
                               min_m + Eigen::Vector3d::Constant(side_m / 2), {0.8, 0.8, 0.8})}),
        viewer_);
    renderer.draw(nothing_, {}, {});
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

TEST_F(Composite, CollidingObjectIsRedAndShaded) {
  const config::Scene scene =
      scene_of({test::object("ball", config::SphereShape{0.2, 3}, {0, 1, 0}, {0.2, 0.5, 0.9})},
               {-1, 0, 1.5});
  const cv::Mat plain = image(scene, nothing_), red = image(scene, nothing_, {"ball"});
  const cv::Vec3b lit = red.at<cv::Vec3b>(190, 280), dark = red.at<cv::Vec3b>(300, 370);
  EXPECT_LT(plain.at<cv::Vec3b>(190, 280)[2], plain.at<cv::Vec3b>(190, 280)[0]);
  for (const cv::Vec3b& c : {lit, dark}) {
    EXPECT_GT(c[2], 1.5 * c[0]);
    EXPECT_GT(c[2], 1.5 * c[1]);
  }
  EXPECT_GT(lit[2], dark[2] + 40);
  EXPECT_EQ(cv::norm(plain, image(scene, nothing_, {"another"}), cv::NORM_INF), 0);
}

// Black to white, bright and dim: the shader's light in double, and sRGB's curve by IEC 61966-2-1.
// Half a level is rounding.
TEST_F(Composite, LightAndSrgbMatchWithinOneLevel) {
  const Eigen::Vector3d light_m(0.5, -0.4, 0.3);
  for (const double shade : {0.0, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0}) {
    config::SceneObject wall = plate("wall", 1, 4, 4);
    wall.colour_rgb = {shade, shade, shade};
    const double albedo = shade <= 0.04045 ? shade / 12.92 : std::pow((shade + 0.055) / 1.055, 2.4);
    const cv::Mat drawn = image(scene_of({wall}, light_m), nothing_);
    const geometry::Pinhole pinhole = config::render_pinhole(viewer_);
    const double reach_m = (wall.world_from_object.translation() - light_m).norm();
    for (const int u : {2, 150, 320, 470, 637})
      for (const int v : {3, 130, 240, 370, 476}) {
        const Eigen::Vector3d p_m((u - pinhole.cx_px) / pinhole.fx_px, 1,
                                  -(v - pinhole.cy_px) / pinhole.fy_px);
        const Eigen::Vector3d to_light = (light_m - p_m) / reach_m;
        const double cosine = -to_light.y() / to_light.norm(),
                     diffuse = 1.6 * cosine / (1 + to_light.squaredNorm());
        const Eigen::Vector3d linear = albedo * (Eigen::Vector3d(0.135, 0.1425, 0.155) +
                                                 diffuse * Eigen::Vector3d(1, 0.97, 0.92));
        for (int channel = 0; channel < 3; ++channel) {
          const double l = std::min(1.0, linear[channel]),
                       level = 255 *
                               (l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055);
          EXPECT_NEAR(drawn.at<cv::Vec3b>(v, u)[2 - channel], level, 0.95)
              << shade << " at " << u << " " << v;
        }
      }
  }
}

TEST_F(Composite, TheSideTowardsTheLightIsBrighter) {
  for (const double side : {-1.0, 1.0}) {
    const cv::Mat drawn = image(
        scene_of({test::object("ball", config::SphereShape{0.2, 3}, {0, 1, 0}, {0.8, 0.8, 0.8})},
                 {2 * side, 0.5, 0}),
        nothing_);
    const int left = brightness(drawn.at<cv::Vec3b>(240, 250)),
              right = brightness(drawn.at<cv::Vec3b>(240, 390));
    EXPECT_GT(side * (right - left), 150);
  }
}

TEST_F(Composite, ACurtainIsLitFromEitherSide) {
  config::SceneObject curtain = test::object(
      "curtain", config::CurtainShape{0.6, 0.6, 12, 12, 0, 1}, {0, 1, 0.3}, {0.8, 0.8, 0.8});
  const cv::Mat front = image(scene_of({curtain}, {0, -1, 0}), nothing_);
  curtain.world_from_object.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  const cv::Mat back = image(scene_of({curtain}, {0, -1, 0}), nothing_);
  EXPECT_GT(brightness(front.at<cv::Vec3b>(240, 320)), 300);
  EXPECT_LE(std::abs(brightness(front.at<cv::Vec3b>(240, 320)) -
                     brightness(back.at<cv::Vec3b>(240, 320))),
            3);  // one level a channel
}

// Grey, by the depth's own normals: a sphere of depth is shaded like the virtual sphere in its
// place.
TEST_F(Composite, AHullWithoutColourIsShadedByItsShape) {
  const Eigen::Vector3d center_world_m(0, 1, 0), light_world_m(-1.5, 0, 1);
  const geometry::Pinhole recon = config::recon_pinhole(viewer_);
  const geometry::Camera camera{recon, eye_};
  const cv::Mat real =
      image(scene_of({}, light_world_m), test::hull_of(eye_, recon, nullptr, [&](int u, int v) {
              return test::ball_depth_m(camera, u, v, center_world_m, 0.2);
            }));
  config::Scene twin = scene_of(
      {test::object("ball", config::SphereShape{0.2, 4}, center_world_m, {0.767, 0.767, 0.767})},
      light_world_m);  // 0.55 in linear light
  const cv::Mat virtual_ball = image(twin, nothing_);
  // The light's nominal distance is taken to the scene's middle, which is another one without the
  // ball: compare ratios.
  const auto ratio = [](const cv::Mat& m) {
    return double(brightness(m.at<cv::Vec3b>(190, 270))) / brightness(m.at<cv::Vec3b>(260, 360));
  };
  EXPECT_GT(ratio(real), 1.3);
  EXPECT_NEAR(ratio(real), ratio(virtual_ball), 0.15);
}

TEST_F(Composite, PosesPersist) {
  Renderer renderer(scene_of({plate("plate", 1, 0.1, 0.1)}), viewer_);
  ObjectPose moved{"plate", Eigen::Isometry3d::Identity(), {}, {}};
  moved.world_from_object.translation() = Eigen::Vector3d(0.3, 2, 0);
  const auto depth_at = [&](double x_m, double y_m) {
    const auto uv = geometry::project({config::render_pinhole(viewer_), eye_}, {x_m, y_m, 0});
    return renderer.depth_m().at<float>(int(std::lround(uv->y())), int(std::lround(uv->x())));
  };
  EXPECT_TRUE(renderer.draw(nothing_, std::vector{moved}, {}).empty());
  EXPECT_NEAR(depth_at(0.3, 2), 2, 2e-3);
  EXPECT_NEAR(depth_at(0, 1), 5, 2e-3);
  EXPECT_TRUE(renderer.draw(nothing_, {}, {}).empty());
  EXPECT_NEAR(depth_at(0.3, 2), 2, 2e-3);
}

TEST_F(Composite, DeformedVerticesMoveAndRecomputeNormals) {
  const config::SceneObject curtain = test::object(
      "curtain", config::CurtainShape{0.6, 0.6, 12, 12, 0, 1}, {0, 1, 0.3}, {0.8, 0.8, 0.8});
  Renderer renderer(scene_of({curtain}, {-1, 0, 0}), viewer_);
  ObjectPose pose{"curtain", curtain.world_from_object, {}, {}};
  const auto bend = [&](double slope) {  // depth grows to the right, or to the left where slope < 0
    pose.vertices_m.clear();
    for (const Eigen::Vector3d& v : config::mesh_of(curtain).vertices_m)
      pose.vertices_m.insert(pose.vertices_m.end(),
                             {float(v.x()), float(slope * v.x()), float(v.z())});
    EXPECT_TRUE(renderer.draw(nothing_, std::vector{pose}, {}).empty());
  };
  bend(1);
  const int away = brightness(renderer.image_bgr().at<cv::Vec3b>(240, 320));
  EXPECT_GT(renderer.depth_m().at<float>(240, 400), renderer.depth_m().at<float>(240, 240) + 0.1f);
  bend(-1);
  const int towards = brightness(renderer.image_bgr().at<cv::Vec3b>(240, 320));
  EXPECT_LT(renderer.depth_m().at<float>(240, 400), renderer.depth_m().at<float>(240, 240) - 0.1f);
  EXPECT_GT(std::abs(towards - away), 100);
}

TEST_F(Composite, AWarmedObjectGlowsWhereItIsWarm) {
  config::SceneObject warmed =
      test::object("plate", config::BoxShape{{0.6, 0.001, 0.6}, 0.05}, {0, 1, 0}, {0.3, 0.4, 0.6});
  const cv::Mat unwarmed = image(scene_of({warmed}), nothing_);
  warmed.warming = config::Warming{};
  EXPECT_EQ(cv::norm(unwarmed, image(scene_of({warmed}), nothing_), cv::NORM_INF), 0) << "cold";
  Renderer renderer(scene_of({warmed}), viewer_);
  ObjectPose pose{"plate", warmed.world_from_object, {}, {}};
  for (const Eigen::Vector3d& v : config::mesh_of(warmed).vertices_m)
    pose.warmth.push_back(v.x() > 0 ? 1.0f : 0.0f);
  EXPECT_TRUE(renderer.draw(nothing_, std::vector{pose}, {}).empty());
  const cv::Mat drawn = renderer.image_bgr();
  const cv::Vec3b cold = drawn.at<cv::Vec3b>(240, 220), warm = drawn.at<cv::Vec3b>(240, 420);
  EXPECT_EQ(cold, unwarmed.at<cv::Vec3b>(240, 220));
  EXPECT_GT(warm[2], 2 * warm[0]);
  EXPECT_GT(warm[2], cold[2] + 50);
  EXPECT_TRUE(renderer.draw(nothing_, {}, {}).empty());
  EXPECT_EQ(cv::norm(drawn, renderer.image_bgr(), cv::NORM_INF), 0) << "it stays";
}

TEST_F(Composite, RejectsMismatchedWarmth) {
  config::SceneObject warmed =
      test::object("plate", config::BoxShape{{0.6, 0.001, 0.6}}, {0, 1, 0}, {0.3, 0.4, 0.6});
  warmed.warming = config::Warming{};
  Renderer renderer(scene_of({warmed, test::object("cold", config::BoxShape{{0.1, 0.1, 0.1}},
                                                   {0, 2, 0}, {0.5, 0.5, 0.5})}),
                    viewer_);
  std::vector<ObjectPose> bad(4,
                              {"plate", warmed.world_from_object, {}, std::vector<float>(8, 0.5f)});
  bad[0].warmth.pop_back();
  bad[1].warmth[3] = std::numeric_limits<float>::quiet_NaN();
  bad[2].object = "cold";
  bad[3].warmth[7] = 1.01f;
  EXPECT_EQ(renderer.draw(nothing_, bad, {}),
            (std::vector<std::string>{
                "plate: 7 values of warmth for a mesh of 8 vertices", "plate: warmth not in 0 .. 1",
                "cold: warmth of an object that is not warmed", "plate: warmth not in 0 .. 1"}));
}

TEST_F(Composite, UndrawablePosesAreReportedAndIgnored) {
  const config::SceneObject curtain = test::object(
      "curtain", config::CurtainShape{0.6, 0.6, 2, 2, 0, 1}, {0, 1, 0.3}, {0.8, 0.8, 0.8});
  Renderer renderer(scene_of({curtain}), viewer_);
  renderer.draw(nothing_, {}, {});
  const cv::Mat before = renderer.image_bgr();
  std::vector<ObjectPose> bad(
      4, {"curtain", curtain.world_from_object, std::vector<float>(27, 0.1f), {}});
  bad[0].object = "curtian";
  bad[1].vertices_m.pop_back();
  bad[2].vertices_m[5] = std::numeric_limits<float>::quiet_NaN();
  bad[3].world_from_object.translation().z() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(renderer.draw(nothing_, bad, {}),
            (std::vector<std::string>{"curtian: not in the scene",
                                      "curtain: 26 vertex coordinates for a mesh of 9 vertices",
                                      "curtain: vertex not finite", "curtain: pose not finite"}));
  EXPECT_EQ(cv::norm(before, renderer.image_bgr(), cv::NORM_INF), 0);
}

TEST_F(Composite, RenderingIsTranslationInvariant) {
  const Eigen::Vector3d far_away_m(1000, -700, 300);
  const auto ball = [](const Eigen::Vector3d& at_m) {
    return test::object("ball", config::SphereShape{0.2, 3}, at_m, {0.8, 0.5, 0.2});
  };
  const cv::Mat here = image(scene_of({ball({0, 1, 0})}, {-1, 0, 1}), nothing_);
  nothing_.eye_from_world = geometry::look_at(far_away_m, far_away_m + Eigen::Vector3d::UnitY());
  const cv::Mat there = image(scene_of({ball(far_away_m + Eigen::Vector3d(0, 1, 0))},
                                       far_away_m + Eigen::Vector3d(-1, 0, 1)),
                              nothing_);
  cv::Mat difference;
  cv::absdiff(here, there, difference);
  EXPECT_LT(cv::mean(difference)[0],
            0.05);  // a few pixels of the ball's border may fall to the other side
}

}  // namespace
}  // namespace fivepipe::render
