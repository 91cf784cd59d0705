// Light, colours and warmth of virtual objects and of a hull without colour.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/render/composite_fixture.h"

namespace fivepipe::render {
namespace {

using Shading = Composite;

// The light is half a metre in front of the wall, then half a metre behind it.
TEST_F(Shading, AWallSeenFromInsideIsLitFromInside) {
  const auto wall_brightness = [&](double light_y_m) {
    return brightness(image(scene_of({test::object("room", config::BoxShape{{2, 2, 2}}, {0, 0, 0},
                                                   {0.8, 0.8, 0.8})},
                                     {0, light_y_m, 0}),
                            empty_hull_)
                          .at<cv::Vec3b>(240, 320));
  };
  EXPECT_GT(wall_brightness(0.5), wall_brightness(1.5) + 150);
}

TEST_F(Shading, ACollidingObjectIsRedAndShaded) {
  const config::Scene scene =
      scene_of({test::object("ball", config::SphereShape{0.2, 3}, {0, 1, 0}, {0.2, 0.5, 0.9})},
               {-1, 0, 1.5});
  const cv::Mat plain = image(scene, empty_hull_), red = image(scene, empty_hull_, {"ball"});
  const cv::Vec3b lit = red.at<cv::Vec3b>(190, 280), dark = red.at<cv::Vec3b>(300, 370);
  EXPECT_LT(plain.at<cv::Vec3b>(190, 280)[2], plain.at<cv::Vec3b>(190, 280)[0]);
  for (const cv::Vec3b& c : {lit, dark}) {
    EXPECT_GT(c[2], 1.5 * c[0]);
    EXPECT_GT(c[2], 1.5 * c[1]);
  }
  EXPECT_GT(lit[2], dark[2] + 40);
  EXPECT_EQ(cv::norm(plain, image(scene, empty_hull_, {"another"}), cv::NORM_INF), 0);
}

// Compares shades from black to white with the light of the shader computed in double and the curve
// of IEC 61966-2-1. The bound is half a level of rounding and the 0.41 levels of the shader's
// curve.
TEST_F(Shading, MatchesLightAndSrgbInDoubleWithinOneLevel) {
  const Eigen::Vector3d light_m(0.5, -0.4, 0.3);
  for (const double shade : {0.0, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0}) {
    config::SceneObject wall = plate("wall", 1, 4, 4);
    wall.colour_rgb = {shade, shade, shade};
    const double albedo = shade <= 0.04045 ? shade / 12.92 : std::pow((shade + 0.055) / 1.055, 2.4);
    const cv::Mat drawn = image(scene_of({wall}, light_m), empty_hull_);
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

TEST_F(Shading, TheSideTowardsTheLightIsBrighter) {
  for (const double side : {-1.0, 1.0}) {
    const cv::Mat drawn = image(
        scene_of({test::object("ball", config::SphereShape{0.2, 3}, {0, 1, 0}, {0.8, 0.8, 0.8})},
                 {2 * side, 0.5, 0}),
        empty_hull_);
    const int left = brightness(drawn.at<cv::Vec3b>(240, 250)),
              right = brightness(drawn.at<cv::Vec3b>(240, 390));
    EXPECT_GT(side * (right - left), 150);
  }
}

TEST_F(Shading, ACurtainIsLitFromEitherSide) {
  config::SceneObject curtain = test::object(
      "curtain", config::CurtainShape{0.6, 0.6, 12, 12, 0, 1}, {0, 1, 0.3}, {0.8, 0.8, 0.8});
  const cv::Mat front = image(scene_of({curtain}, {0, -1, 0}), empty_hull_);
  curtain.world_from_object.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  const cv::Mat back = image(scene_of({curtain}, {0, -1, 0}), empty_hull_);
  EXPECT_GT(brightness(front.at<cv::Vec3b>(240, 320)), 300);
  EXPECT_LE(std::abs(brightness(front.at<cv::Vec3b>(240, 320)) -
                     brightness(back.at<cv::Vec3b>(240, 320))),
            3);  // one level per channel
}

// A grey hull is shaded by the normals of its depth: a spherical hull has the shading of a virtual
// sphere at the same place.
TEST_F(Shading, AHullWithoutColourIsShadedByItsShape) {
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
  const cv::Mat virtual_ball = image(twin, empty_hull_);
  // The light's nominal distance depends on the centre of the scene, which differs without the
  // ball, so compare ratios.
  const auto ratio = [](const cv::Mat& m) {
    return double(brightness(m.at<cv::Vec3b>(190, 270))) / brightness(m.at<cv::Vec3b>(260, 360));
  };
  EXPECT_GT(ratio(real), 1.3);
  EXPECT_NEAR(ratio(real), ratio(virtual_ball), 0.15);
}

TEST_F(Shading, DeformedVerticesMoveAndGetNewNormals) {
  const config::SceneObject curtain = test::object(
      "curtain", config::CurtainShape{0.6, 0.6, 12, 12, 0, 1}, {0, 1, 0.3}, {0.8, 0.8, 0.8});
  Renderer renderer(scene_of({curtain}, {-1, 0, 0}), viewer_);
  ObjectPose pose{"curtain", curtain.world_from_object, {}, {}};
  const auto bend = [&](double slope) {  // slope > 0: depth grows to the right
    pose.vertices_m.clear();
    for (const Eigen::Vector3d& v : config::mesh_of(curtain).vertices_m)
      pose.vertices_m.insert(pose.vertices_m.end(),
                             {float(v.x()), float(slope * v.x()), float(v.z())});
    renderer.draw(empty_hull_, std::vector{pose}, {});
  };
  bend(1);
  const int away = brightness(renderer.image_bgr().at<cv::Vec3b>(240, 320));
  EXPECT_GT(renderer.depth_m().at<float>(240, 400), renderer.depth_m().at<float>(240, 240) + 0.1f);
  bend(-1);
  const int towards = brightness(renderer.image_bgr().at<cv::Vec3b>(240, 320));
  EXPECT_LT(renderer.depth_m().at<float>(240, 400), renderer.depth_m().at<float>(240, 240) - 0.1f);
  EXPECT_GT(std::abs(towards - away), 100);
}

TEST_F(Shading, AnObjectGlowsWhereItIsWarm) {
  config::SceneObject warmed =
      test::object("plate", config::BoxShape{{0.6, 0.001, 0.6}, 0.05}, {0, 1, 0}, {0.3, 0.4, 0.6});
  const cv::Mat unwarmed = image(scene_of({warmed}), empty_hull_);
  warmed.warming = config::Warming{};
  EXPECT_EQ(cv::norm(unwarmed, image(scene_of({warmed}), empty_hull_), cv::NORM_INF), 0) << "cold";
  Renderer renderer(scene_of({warmed}), viewer_);
  ObjectPose pose{"plate", warmed.world_from_object, {}, {}};
  for (const Eigen::Vector3d& v : config::mesh_of(warmed).vertices_m)
    pose.warmth.push_back(v.x() > 0 ? 1.0f : 0.0f);
  renderer.draw(empty_hull_, std::vector{pose}, {});
  const cv::Mat drawn = renderer.image_bgr();
  const cv::Vec3b cold = drawn.at<cv::Vec3b>(240, 220), warm = drawn.at<cv::Vec3b>(240, 420);
  EXPECT_EQ(cold, unwarmed.at<cv::Vec3b>(240, 220));
  EXPECT_GT(warm[2], 2 * warm[0]);
  EXPECT_GT(warm[2], cold[2] + 50);
  renderer.draw(empty_hull_, {}, {});
  EXPECT_EQ(cv::norm(drawn, renderer.image_bgr(), cv::NORM_INF), 0)
      << "the warmth changed without a pose";
}

TEST_F(Shading, InvalidWarmthIsUndrawable) {
  config::SceneObject warmed =
      test::object("plate", config::BoxShape{{0.6, 0.001, 0.6}}, {0, 1, 0}, {0.3, 0.4, 0.6});
  warmed.warming = config::Warming{};
  const Renderer renderer(scene_of({warmed, test::object("cold", config::BoxShape{{0.1, 0.1, 0.1}},
                                                         {0, 2, 0}, {0.5, 0.5, 0.5})}),
                          viewer_);
  const ObjectPose good{"plate", warmed.world_from_object, {}, std::vector<float>(8, 0.5f)};
  EXPECT_EQ(renderer.why_undrawable(good), std::nullopt);
  const ObjectPose extreme{"plate", warmed.world_from_object, {}, {0, 0, 0, 0, 1, 1, 1, 1}};
  EXPECT_EQ(renderer.why_undrawable(extreme), std::nullopt);
  std::vector<ObjectPose> bad(5, good);
  bad[0].warmth.pop_back();
  bad[1].warmth[3] = std::numeric_limits<float>::quiet_NaN();
  bad[2].object = "cold";
  bad[3].warmth[7] = 1.01f;
  bad[4].warmth[0] = -0.01f;
  EXPECT_EQ(renderer.why_undrawable(bad[0]), "7 values of warmth for a mesh of 8 vertices");
  EXPECT_EQ(renderer.why_undrawable(bad[1]), "warmth outside 0 .. 1");
  EXPECT_EQ(renderer.why_undrawable(bad[2]), "warmth for an object without warmth in the scene");
  EXPECT_EQ(renderer.why_undrawable(bad[3]), "warmth outside 0 .. 1");
  EXPECT_EQ(renderer.why_undrawable(bad[4]), "warmth outside 0 .. 1");
}

}  // namespace
}  // namespace fivepipe::render
