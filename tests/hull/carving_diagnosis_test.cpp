// The carving diagnosis, against in_hull() with subsets of the cameras and on scenes with known
// answers.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/hull/carving_diagnosis.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/hull/test_pool.h"
#include "tests/support/not_finite.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::AlignedBox3d;
using Eigen::Vector3d;

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
        {test::random_cameras(random, 1 + seed % 5, 60, 45), test::random_object(random, 3)});
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
  auto silhouettes = test::silhouettes_of(
      {test::random_cameras(random, 2, 60, 45), test::random_object(random, 2)});
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
  auto rig = test::silhouettes_of(
      {test::random_cameras(random, 5, 60, 45), test::random_object(random, 3)});
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
    EXPECT_EQ(diagnosis.hull.error_m3, 0);
    EXPECT_EQ(diagnosis.too_few.error_m3, 0);
    ASSERT_EQ(diagnosis.cameras.size(), 3u);
    EXPECT_EQ(diagnosis.cameras[2].removed.error_m3, 0);
    EXPECT_FALSE(summary(diagnosis).empty());
  }
}

// SplitMix64 (Steele, Lea and Flood, 2014): the points are those of its sequence, so a diagnosis is
// the same on every machine.
double splitmix64(std::uint64_t seed, std::uint64_t index) {
  std::uint64_t z = seed * 0xd1342543de82ef95u + (index + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return double((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
}

SampledVolume sampled_volume(int count, int points, double box_m3) {
  const double p = double(count) / points;
  const bool certain = count == 0 || count == points;
  return {p * box_m3, box_m3 * (certain ? 3.0 / points : std::sqrt(p * (1 - p) / points))};
}

void expect_equal(const SampledVolume& found, const SampledVolume& expected) {
  EXPECT_DOUBLE_EQ(found.volume_m3, expected.volume_m3);
  EXPECT_DOUBLE_EQ(found.error_m3, expected.error_m3);
}

// Every count is that of in_hull() with and without each camera, over more than one batch of
// points.
TEST(DiagnoseVolume, EqualsInHullAtEveryPointOfTheSequence) {
  const AlignedBox3d box(Vector3d(-0.5, -0.3, -0.6), Vector3d(0.4, 0.5, 0.2));
  constexpr int kPoints = 4500;
  test::Random random(12);
  auto silhouettes = test::silhouettes_of(
      {test::random_cameras(random, 4, 60, 45), test::random_object(random, 3, 0.3)});
  // One camera looks away from a part of the box, and one is inside of it.
  silhouettes[2].camera.camera_from_world = geometry::look_at({0.9, 0, 0}, {0.2, 0.4, 0.1});
  silhouettes[3].camera.camera_from_world = geometry::look_at({-0.2, 0, 0}, {0.2, 0, 0.05});
  for (const HullRule& rule : kRules) {
    int hull = 0, too_few = 0;
    struct {
      int removed = 0, alone = 0, unseen = 0, kept = 0;
    } expected[4];
    for (std::uint64_t i = 0; i < kPoints; ++i) {
      const Vector3d p = box.min() + Vector3d(splitmix64(9, 3 * i), splitmix64(9, 3 * i + 1),
                                              splitmix64(9, 3 * i + 2))
                                         .cwiseProduct(box.sizes());
      const PointDiagnosis point = diagnose_point(silhouettes, p, rule);
      hull += in_hull(silhouettes, p, rule);
      too_few += point.too_few;
      for (int c = 0; c < 4; ++c) {
        const CameraDiagnosis& camera = point.cameras[std::size_t(c)];
        const bool others_keep = in_hull(without(silhouettes, c), p, rule);
        expected[c].removed += camera.removes;
        expected[c].kept += others_keep;
        expected[c].alone += camera.removes && others_keep;
        expected[c].unseen += camera.removes && others_keep &&
                              (camera.verdict == CameraVerdict::behind ||
                               camera.verdict == CameraVerdict::outside_image);
      }
    }
    const VolumeDiagnosis found =
        diagnose_volume(silhouettes, box, test_pool(), rule, {kPoints, 9});
    EXPECT_EQ(found.points, kPoints);
    const auto volume = [&](int count) { return sampled_volume(count, kPoints, box.volume()); };
    expect_equal(found.hull, volume(hull));
    expect_equal(found.too_few, volume(too_few));
    for (int c = 0; c < 4; ++c) {
      SCOPED_TRACE(c);
      const CameraContribution& camera = found.cameras[std::size_t(c)];
      expect_equal(camera.removed, volume(expected[c].removed));
      expect_equal(camera.removed_alone, volume(expected[c].alone));
      expect_equal(camera.removed_alone_unseen, volume(expected[c].unseen));
      expect_equal(camera.kept_by_others, volume(expected[c].kept));
    }
  }
}

TEST(DiagnoseVolume, SamplesTwoHundredThousandPointsFromSeedOne) {
  EXPECT_EQ(DiagnosisSampling{}.points, 200'000);
  EXPECT_EQ(DiagnosisSampling{}.seed, 1u);
}

// The error of a fraction of 1 or of few points is never larger than the box.
TEST_F(Prisms, TheErrorIsAtMostTheBox) {
  for (int c = 0; c < 3; ++c) fill(c, {0, 0, 200, 200});
  const AlignedBox3d small(Vector3d(-0.1, -0.1, -0.1), Vector3d(0.1, 0.1, 0.1));
  const auto with = [&](int points) {
    return diagnose_volume(silhouettes, small, test_pool(), {}, {points, 1}).hull;
  };
  expect_equal(with(2), {0.008, 0.008});
  expect_equal(with(4), {0.008, 0.006});
  for (int c = 0; c < 3; ++c) silhouettes[std::size_t(c)].pixels = ObjectPixels(200, 200);
  expect_equal(with(4), {0, 0.006});
}

struct SummaryOfADiagnosis : ::testing::Test {
  VolumeDiagnosis diagnosis;
  SummaryOfADiagnosis() {  // a box of 2 m3
    diagnosis.box_world_m = AlignedBox3d(Vector3d(0, 0, 0), Vector3d(1, 1, 2));
    diagnosis.hull = {0.25, 0.0123};
    diagnosis.cameras.resize(3);
    for (CameraContribution& c : diagnosis.cameras) c.kept_by_others = {0.5, 0.01};
  }
};

TEST_F(SummaryOfADiagnosis, NamesCamerasByWhatTheyRemoveAlone) {
  diagnosis.cameras[0].removed_alone = {0.0051, 0.001};  // 1.02 % of 0.5 m3
  diagnosis.cameras[1].removed_alone = {0.25, 0.02};
  diagnosis.cameras[1].removed_alone_unseen = {0.125, 0.02};  // half, which is not most
  diagnosis.cameras[2].removed_alone = {0.125, 0.02};
  diagnosis.cameras[2].removed_alone_unseen = {0.07, 0.02};
  EXPECT_EQ(summary(diagnosis, std::vector<std::string>{"left", "", "top", "unused"}),
            "The hull fills 250 +- 1e+01 litres, 12 % of the box."
            " camera 1 alone removes 50 % of what the others keep: 250 +- 2e+01 litres of"
            " 500 +- 1e+01 litres."
            " top alone removes 25 % of what the others keep: 125 +- 2e+01 litres of"
            " 500 +- 1e+01 litres; most of that is outside its image or behind it."
            " left alone removes 1 % of what the others keep: 5.1 +- 1 litres of"
            " 500 +- 1e+01 litres.");
}

TEST_F(SummaryOfADiagnosis, KeepsTheOrderOfCamerasThatRemoveTheSame) {
  for (CameraContribution& c : diagnosis.cameras) c.removed_alone = {0.05, 0.001};
  const std::string text = summary(diagnosis);
  EXPECT_LT(text.find("camera 0 alone"), text.find("camera 1 alone"));
  EXPECT_LT(text.find("camera 1 alone"), text.find("camera 2 alone"));
  EXPECT_NE(text.find("camera 2 alone"), std::string::npos);
}

TEST_F(SummaryOfADiagnosis, OmitsCamerasThatRemoveAtMostAHundredth) {
  diagnosis.cameras[0].kept_by_others = {0.5, 0};
  diagnosis.cameras[0].removed_alone = {0.01 * 0.5, 0};
  diagnosis.cameras[1].removed_alone = {0.0049, 0};
  diagnosis.hull.volume_m3 = 0.02;
  EXPECT_EQ(summary(diagnosis),
            "The hull fills 20 +- 1e+01 litres, 1 % of the box."
            " No single camera removes more than 1 % of what the others keep.");
  diagnosis.too_few = {0.003, 0.0002};
  diagnosis.hull = {0, 0.0004};
  EXPECT_EQ(summary(diagnosis),
            "The hull is empty in this box (less than 0.4 litres)."
            " No single camera empties it: other cameras remove the same points."
            " 3 +- 0.2 litres are removed by no camera but seen by too few cameras.");
  diagnosis.cameras.resize(2);
  EXPECT_NE(summary(diagnosis).find("No single camera"), std::string::npos);
  diagnosis.cameras.resize(1);  // with one camera there are no others
  EXPECT_EQ(summary(diagnosis),
            "The hull is empty in this box (less than 0.4 litres)."
            " 3 +- 0.2 litres are removed by no camera but seen by too few cameras.");
}

TEST_F(SummaryOfADiagnosis, ListsCamerasThatEmptyTheHull) {
  diagnosis.hull = {0, 0.0004};
  for (CameraContribution& c : diagnosis.cameras) c.kept_by_others = {};
  diagnosis.cameras[0].unusable = diagnosis.cameras[0].no_object_pixel = true;
  diagnosis.cameras[2].no_object_pixel = true;
  const std::string empty = "The hull is empty in this box (less than 0.4 litres).",
                    others = " No single camera empties it: other cameras remove the same points.";
  EXPECT_EQ(summary(diagnosis),
            empty +
                " The calibration of camera 0 is not finite, so there is no hull."
                " No object pixel in camera 2: it removes everything in its view." +
                others);
  diagnosis.cameras[0].unusable = false;
  diagnosis.cameras[1].no_object_pixel = true;
  EXPECT_EQ(
      summary(diagnosis, std::vector<std::string>{"a", "b", "c"}),
      empty + " No object pixel in a, b and c: they remove everything in their views." + others);
  diagnosis.cameras[0].unusable = diagnosis.cameras[1].unusable = true;
  diagnosis.cameras[2].no_object_pixel = false;
  EXPECT_EQ(summary(diagnosis, std::vector<std::string>{"a", "b"}),
            empty + " The calibration of a and b is not finite, so there is no hull." + others);
}

// The others keep nothing, so the part that this camera removes has no percentage.
TEST_F(SummaryOfADiagnosis, StatesZeroPercentOfNothing) {
  diagnosis.cameras[1].kept_by_others = {};
  diagnosis.cameras[1].removed_alone = {0.001, 0.001};
  EXPECT_NE(summary(diagnosis).find("camera 1 alone removes 0 % of what the others keep: 1 +- 1 "
                                    "litres of 0 +- 0 litres."),
            std::string::npos)
      << summary(diagnosis);
}

TEST_F(SummaryOfADiagnosis, ReportsAnEmptyBoxBeforeTheHull) {
  diagnosis.box_world_m = AlignedBox3d(Vector3d(0, 0, 0), Vector3d(1, 0, 2));
  EXPECT_EQ(summary(diagnosis), "The box is empty, so it has no volume to measure.");
  diagnosis.box_world_m = AlignedBox3d(Vector3d(0, 0, 0), Vector3d(1, 0.001, 2));
  EXPECT_EQ(summary(diagnosis).find("The box is empty"), std::string::npos);
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
