// The carving diagnosis, against in_hull() with subsets of the cameras and on scenes with known
// answers.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/hull/carving_diagnosis.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::AlignedBox3d;
using Eigen::Vector3d;

base::WorkerPool& test_pool() {
  static base::WorkerPool pool(2);
  return pool;
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                 kInfinity = std::numeric_limits<double>::infinity();
const HullRule kRules[] = {{}, {Limits::seen, 1}, {Limits::seen, 2}, {Limits::seen, 3}};

std::vector<Silhouette> without(std::vector<Silhouette> silhouettes, int camera) {
  silhouettes.erase(silhouettes.begin() + camera);
  return silhouettes;
}

double distance_of_every_pixel(const ObjectPixels& pixels, const Eigen::Vector2d& uv) {
  double nearest = kInfinity;
  for (int v = 0; v < pixels.height_px(); ++v)
    for (int u = 0; u < pixels.width_px(); ++u)
      if (pixels.contains(u, v))
        nearest = std::min(nearest, std::hypot(std::max(0.0, std::abs(uv.x() - u) - 0.5),
                                               std::max(0.0, std::abs(uv.y() - v) - 0.5)));
  return nearest;
}

TEST(DiagnosePoint, AgreesWithInHullWithAndWithoutEachCamera) {
  int alone = 0, too_few = 0;
  for (int seed = 1; seed <= 15; ++seed) {
    test::Random random(seed);
    const auto silhouettes = test::silhouettes_of(
        test::random_object(random, 3), test::random_cameras(random, 1 + seed % 5, 60, 45));
    for (const HullRule& rule : kRules)
      for (int i = 0; i < 60; ++i) {
        const Vector3d p = test::random_in_ball(random, i % 2 ? 0.25 : 2.0);
        const PointDiagnosis diagnosis = diagnose_point(silhouettes, p, rule);
        EXPECT_EQ(diagnosis.in_hull, in_hull(silhouettes, p, rule));
        ASSERT_EQ(diagnosis.cameras.size(), silhouettes.size());
        std::vector<int> expected;
        int removing = 0;
        for (int c = 0; c < int(silhouettes.size()); ++c) {
          const CameraDiagnosis& camera = diagnosis.cameras[std::size_t(c)];
          removing += camera.removes;
          if (!diagnosis.in_hull && camera.removes && in_hull(without(silhouettes, c), p, rule))
            expected.push_back(c);
          const auto uv = geometry::project(silhouettes[std::size_t(c)].camera, p);
          EXPECT_EQ(camera.verdict == CameraVerdict::behind, !uv.has_value());
          if (uv) {
            EXPECT_NEAR(camera.to_object_px,
                        distance_of_every_pixel(silhouettes[std::size_t(c)].pixels, *uv),
                        1e-9 * (1 + uv->norm()));
          } else {
            EXPECT_EQ(camera.to_object_px, kInfinity);
          }
        }
        EXPECT_EQ(diagnosis.alone, expected);
        EXPECT_EQ(diagnosis.too_few, !diagnosis.in_hull && removing == 0);
        alone += int(expected.size()), too_few += diagnosis.too_few;
      }
  }
  EXPECT_GT(alone, 100);
  EXPECT_GT(too_few, 100);
}

TEST(DiagnosePoint, DegeneratePointsHaveTheirVerdict) {
  test::Random random(1);
  auto silhouettes =
      test::silhouettes_of(test::random_object(random, 2), test::random_cameras(random, 2, 60, 45));
  const geometry::Camera& camera = silhouettes[0].camera;
  EXPECT_EQ(diagnose_point(silhouettes,
                           geometry::camera_center_world_m(camera) -
                               camera.camera_from_world.linear().row(2).transpose(),
                           {})
                .cameras[0]
                .verdict,
            CameraVerdict::behind);
  EXPECT_EQ(diagnose_point(silhouettes, camera.camera_from_world.inverse() * Vector3d(0, 0, 1000))
                    .cameras[0]
                    .verdict == CameraVerdict::outside_image,
            false);
  EXPECT_EQ(diagnose_point(silhouettes, camera.camera_from_world.inverse() * Vector3d(1, 0, 1e-9))
                .cameras[0]
                .verdict,
            CameraVerdict::outside_image);
  const PointDiagnosis nan = diagnose_point(silhouettes, {kNaN, 0, 0});
  EXPECT_FALSE(nan.in_hull || nan.too_few);
  EXPECT_TRUE(nan.cameras.empty() && nan.alone.empty());
  EXPECT_TRUE(diagnose_point({}, {0, 0, 0}).too_few);
  silhouettes[1].camera.pinhole.cx_px = kInfinity;
  for (const HullRule& rule : kRules) {
    const PointDiagnosis unusable = diagnose_point(silhouettes, {0, 0, 0}, rule);
    EXPECT_EQ(unusable.cameras[1].verdict, CameraVerdict::unusable);
    EXPECT_TRUE(unusable.cameras[1].removes && !unusable.in_hull);
  }
  silhouettes[1] = {{{0, 0, 10, 10, 0, 0}, silhouettes[0].camera.camera_from_world},
                    ObjectPixels(0, 0)};
  EXPECT_EQ(diagnose_point(silhouettes, {0, 0, 0}).cameras[1].verdict,
            CameraVerdict::outside_image);
  EXPECT_EQ(diagnose_point(silhouettes, {0, 0, 0}).cameras[1].to_object_px, kInfinity);
}

// Three cameras on the axes, so far away that the pyramids of their pixels are nearly prisms and
// volumes are those of boxes.
struct Prisms : ::testing::Test {
  static constexpr double kFar_m = 1000;
  const AlignedBox3d box{Vector3d(-0.5, -0.5, -0.5), Vector3d(0.5, 0.5, 0.5)};
  std::vector<Silhouette> silhouettes;
  Prisms() {  // 100 pixels per metre; along x, y and z
    for (const Vector3d& eye :
         {Vector3d(kFar_m, 0, 0), Vector3d(0, kFar_m, 0), Vector3d(0, 0, kFar_m)})
      silhouettes.push_back(
          {{{200, 200, 100 * kFar_m, 100 * kFar_m, 99.5, 99.5},
            geometry::look_at(eye, {0, 0, 0}, eye.z() > 0 ? Vector3d(0, 1, 0) : Vector3d(0, 0, 1))},
           ObjectPixels(200, 200)});
  }
  void fill(int camera, const PixelRect& r) {
    for (int v = r.v0_px; v < r.v1_px; ++v)
      for (int u = r.u0_px; u < r.u1_px; ++u) silhouettes[std::size_t(camera)].pixels.set(u, v);
  }
  static void expect_volume(const SampledVolume& v, double expected_m3) {
    EXPECT_NEAR(
        v.volume_m3, expected_m3,
        4 * v.error_m3 + 2e-3 * expected_m3);  // the sides of a pyramid deviate by 1 in 2000
    EXPECT_LT(v.error_m3, 0.01);
  }
};

TEST_F(Prisms, VolumesEqualTheClosedForm) {
  fill(0, {0, 0, 200, 200});
  fill(1, {0, 0, 200, 110});   // keeps 60 % of the box: rows count downward, z upward
  fill(2, {90, 0, 200, 200});  // keeps 60 % of the box
  const VolumeDiagnosis diagnosis = diagnose_volume(silhouettes, box, test_pool());
  expect_volume(diagnosis.hull, 0.36);
  EXPECT_EQ(diagnosis.too_few.volume_m3, 0);
  expect_volume(diagnosis.cameras[0].removed, 0);
  expect_volume(diagnosis.cameras[0].kept_by_others, 0.36);
  for (const int c : {1, 2}) {
    expect_volume(diagnosis.cameras[std::size_t(c)].removed, 0.4);
    expect_volume(diagnosis.cameras[std::size_t(c)].removed_alone, 0.24);
    expect_volume(diagnosis.cameras[std::size_t(c)].kept_by_others, 0.6);
    expect_volume(diagnosis.cameras[std::size_t(c)].removed_alone_unseen, 0);
  }
  const std::string words = summary(diagnosis, std::vector<std::string>{"left", "right"});
  EXPECT_NE(words.find("right alone removes 40 % of what the others keep"), std::string::npos)
      << words;
  EXPECT_NE(words.find("camera 2 alone removes 40 % of what the others keep"), std::string::npos)
      << words;
  EXPECT_EQ(words.find("left"), std::string::npos) << words;
}

// Two cameras each limit one axis to half of the box, so a quarter remains.
TEST_F(Prisms, PointsAreIndependentAlongEachPairOfAxes) {
  for (const auto& [a, b] : {std::pair{PixelRect{100, 0, 200, 200}, PixelRect{100, 0, 200, 200}},
                             {{100, 0, 200, 200}, {0, 100, 200, 200}},
                             {{0, 100, 200, 200}, {100, 0, 200, 200}}}) {
    auto rig = silhouettes;
    fill(0, a), fill(1, b), fill(2, {0, 0, 200, 200});
    expect_volume(diagnose_volume(silhouettes, box, test_pool()).hull, 0.25);
    silhouettes = rig;
  }
}

// The spread over many seeds is the stated error.
TEST_F(Prisms, ErrorsAreBinomial) {
  fill(0, {0, 0, 200, 200});
  fill(1, {0, 0, 200, 110});
  fill(2, {0, 0, 200, 200});
  double sum2 = 0, stated2 = 0;
  const int seeds = 200;
  for (int seed = 1; seed <= seeds; ++seed) {
    const VolumeDiagnosis diagnosis =
        diagnose_volume(silhouettes, box, test_pool(), {}, {500, std::uint64_t(seed)});
    sum2 += std::pow(diagnosis.hull.volume_m3 - 0.6, 2);
    stated2 += std::pow(diagnosis.hull.error_m3, 2);
  }
  EXPECT_NEAR(std::sqrt(sum2 / stated2), 1,
              0.2);  // 4 standard deviations of a spread of 200 samples
}

TEST_F(Prisms, NamesACameraWithoutObjectPixel) {
  fill(0, {50, 50, 150, 150});
  fill(2, {50, 50, 150, 150});
  for (const HullRule& rule : kRules) {
    const VolumeDiagnosis diagnosis =
        diagnose_volume(silhouettes, box, test_pool(), rule, {20'000, 3});
    EXPECT_EQ(diagnosis.hull.volume_m3, 0);
    EXPECT_GT(diagnosis.hull.error_m3, 0);
    EXPECT_TRUE(diagnosis.cameras[1].no_object_pixel);
    EXPECT_FALSE(diagnosis.cameras[0].no_object_pixel || diagnosis.cameras[2].no_object_pixel);
    if (rule.min_seen > 2) continue;  // two remaining cameras are too few
    EXPECT_NEAR(diagnosis.cameras[1].removed_alone.volume_m3, 1, 0.01);
    EXPECT_EQ(diagnosis.cameras[0].removed_alone.volume_m3, 0);
    const std::string words = summary(diagnosis);
    EXPECT_NE(words.find("The hull is empty"), std::string::npos) << words;
    EXPECT_NE(words.find("No object pixel in camera 1:"), std::string::npos) << words;
    EXPECT_NE(words.find("camera 1 alone removes 100 %"), std::string::npos) << words;
  }
}

TEST_F(Prisms, NamesACameraThatLooksAwayAndOneThatIsNotFinite) {
  for (int c = 0; c < 3; ++c) fill(c, {0, 0, 200, 200});
  silhouettes[2].camera.camera_from_world = geometry::look_at({0, 0, 10}, {0, 0, 20}, {0, 1, 0});
  VolumeDiagnosis diagnosis = diagnose_volume(silhouettes, box, test_pool());
  EXPECT_NEAR(diagnosis.cameras[2].removed_alone_unseen.volume_m3, 1, 1e-12);
  EXPECT_NE(summary(diagnosis).find("is outside its image or behind it"), std::string::npos)
      << summary(diagnosis);
  EXPECT_NEAR(diagnose_volume(silhouettes, box, test_pool(), {Limits::seen, 2}).hull.volume_m3, 1,
              0.01);
  EXPECT_NE(summary(diagnose_volume(silhouettes, box, test_pool(), {Limits::seen, 3}))
                .find("seen by too few cameras"),
            std::string::npos);
  silhouettes[2].camera.pinhole.fx_px = kNaN;
  diagnosis = diagnose_volume(silhouettes, box, test_pool(), {Limits::seen, 2});
  EXPECT_TRUE(diagnosis.cameras[2].unusable);
  EXPECT_EQ(diagnosis.hull.volume_m3, 0);
  EXPECT_NE(summary(diagnosis).find("The calibration of camera 2 is not finite"), std::string::npos)
      << summary(diagnosis);
}

TEST_F(Prisms, IsIndependentOfThreadCountAndCameraOrder) {
  test::Random random(8);
  auto rig =
      test::silhouettes_of(test::random_object(random, 3), test::random_cameras(random, 5, 60, 45));
  base::WorkerPool one(1), five(5);
  for (const HullRule& rule : kRules) {
    const VolumeDiagnosis a = diagnose_volume(rig, box, one, rule, {30'000, 7}),
                          b = diagnose_volume(rig, box, five, rule, {30'000, 7});
    auto turned = rig;
    std::reverse(turned.begin(), turned.end());
    const VolumeDiagnosis c = diagnose_volume(turned, box, five, rule, {30'000, 7});
    EXPECT_EQ(a.hull.volume_m3, b.hull.volume_m3);
    EXPECT_EQ(a.hull.volume_m3, c.hull.volume_m3);
    for (std::size_t i = 0; i < rig.size(); ++i)
      for (const SampledVolume CameraContribution::*part :
           {&CameraContribution::removed, &CameraContribution::removed_alone,
            &CameraContribution::removed_alone_unseen, &CameraContribution::kept_by_others}) {
        EXPECT_EQ((a.cameras[i].*part).volume_m3, (b.cameras[i].*part).volume_m3);
        EXPECT_EQ((a.cameras[i].*part).volume_m3, (c.cameras[rig.size() - 1 - i].*part).volume_m3);
      }
  }
}

TEST_F(Prisms, NoCameraOrNoBoxIsReported) {
  EXPECT_EQ(diagnose_volume({}, box, test_pool()).hull.volume_m3, 0);
  EXPECT_EQ(summary(diagnose_volume({}, box, test_pool())),
            "There is no camera, so there is no hull.");
  for (const AlignedBox3d& none :
       {AlignedBox3d(), AlignedBox3d(Vector3d(0, 0, 0), Vector3d(1, 0, 1)),
        AlignedBox3d(Vector3d(0, 0, 0), Vector3d(kInfinity, 1, 1)),
        AlignedBox3d(Vector3d(kNaN, 0, 0), Vector3d(1, 1, 1))}) {
    const VolumeDiagnosis diagnosis = diagnose_volume(silhouettes, none, test_pool());
    EXPECT_EQ(diagnosis.hull.volume_m3, 0);
    EXPECT_EQ(diagnosis.cameras.size(), 3u);
    EXPECT_FALSE(summary(diagnosis).empty());
  }
}

// Only the fifth camera, from above, removes the ghosts alone.
TEST(DiagnoseVolume, NoSingleCameraRemovesGhostVolumes) {
  const std::vector<Capsule> people{{{-0.6, 0, 0.2}, {-0.6, 0, 1.5}, 0.2},
                                    {{0.6, 0, 0.2}, {0.6, 0, 1.5}, 0.2}};
  std::vector<geometry::Camera> cameras;
  for (const double angle : {0.25, 0.75, 1.25, 1.75})
    cameras.push_back({geometry::pinhole_from_fov(160, 121, 1.0),
                       geometry::look_at({4 * std::cos(angle * std::numbers::pi),
                                          4 * std::sin(angle * std::numbers::pi), 1.0},
                                         {0, 0, 0.9})});
  cameras.push_back({geometry::pinhole_from_fov(160, 121, 0.8),
                     geometry::look_at({0, 0, 6}, {0, 0, 0}, {0, 1, 0})});
  const auto silhouettes = test::silhouettes_of(people, cameras);
  const AlignedBox3d around_a_ghost(Vector3d(-0.1, -0.7, 0.5), Vector3d(0.1, -0.5, 1.2));
  const VolumeDiagnosis four = diagnose_volume(std::span(silhouettes).first(4), around_a_ghost,
                                               test_pool(), {}, {5000, 1}),
                        five = diagnose_volume(silhouettes, around_a_ghost, test_pool(), {},
                                               {5000, 1});
  EXPECT_GT(four.hull.volume_m3, 0.5 * around_a_ghost.volume());
  EXPECT_EQ(five.hull.volume_m3, 0);
  EXPECT_EQ(five.cameras[4].removed_alone.volume_m3, four.hull.volume_m3);
  EXPECT_EQ(diagnose_point(silhouettes, {0, -0.6, 0.9}).alone, std::vector<int>{4});
}

}  // namespace
}  // namespace fivepipe::hull
