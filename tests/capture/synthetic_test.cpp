#include <cmath>
#include <cstring>

#include "common/hull/hull.h"
#include "tests/support/capture_rig.h"
#include "tests/support/golden_image.h"

namespace fivepipe::capture {
namespace {

bool same_bits(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() &&
         std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

cv::Mat image_of(const config::SyntheticWorld& world, const config::RigCamera& camera,
                 std::int64_t frame) {
  SyntheticImageSource source(world, camera, 30, {}, test::test_room());
  cv::Mat image;
  source.read(frame, image);
  return image;
}

TEST(SyntheticWorld, RepeatsExactlyWithItsPeriod) {
  config::SyntheticWorld world;
  world.period_s = 4.0;
  for (int i = 0; i < 64; ++i) {  // multiples of 1/16 s, so that adding the period is exact
    const auto one = test::synthetic_object(world, i / 16.0),
               later = test::synthetic_object(world, i / 16.0 + 12.0);
    ASSERT_EQ(one.size(), later.size());
    for (std::size_t k = 0; k < one.size(); ++k) {
      EXPECT_EQ(one[k].a_world_m, later[k].a_world_m);
      EXPECT_EQ(one[k].b_world_m, later[k].b_world_m);
    }
  }
}

TEST(SyntheticWorld, MovesAtMost1500MmPerSecondInsideItsBox) {
  const config::SyntheticWorld world;
  Eigen::AlignedBox3d reached;
  std::vector<hull::Capsule> before = test::synthetic_object(world, 0);
  for (int i = 0; i <= 400; ++i) {
    const std::vector<hull::Capsule> object = test::synthetic_object(world, 0.01 * i);
    for (std::size_t k = 0; k < object.size(); ++k) {
      EXPECT_GT(std::min(object[k].a_world_m.z(), object[k].b_world_m.z()) - object[k].radius_m,
                0.0)
          << "the part intersects the table";
      // The palm moves at most 2 pi (0.25, 0.15, 2 x 0.14) m / 4 s and also rotates; 1.5 m/s bounds
      // both.
      EXPECT_LT((object[k].a_world_m - before[k].a_world_m).norm(), 0.015);
    }
    before = object;
    reached.extend(0.5 * (object[0].a_world_m + object[0].b_world_m));
  }
  EXPECT_NEAR(reached.max().x(), 0.25, 0.04);
  EXPECT_NEAR(reached.min().x(), -0.25, 0.04);
  EXPECT_NEAR(reached.max().y(), 0.20, 0.02);
  EXPECT_NEAR(reached.min().z(), 0.12, 0.03);
  EXPECT_NEAR(reached.max().z(), 0.40, 0.03);
}

TEST(SyntheticWorld, HasThePipeOfThePaper) {
  for (const SyntheticPart& part : synthetic_parts({}, 1.3))
    if (part.material == Material::pipe) {
      EXPECT_NEAR(
          (part.capsule.a_world_m - part.capsule.b_world_m).norm() + 2 * part.capsule.radius_m,
          0.14, 1e-12);
      EXPECT_DOUBLE_EQ(part.capsule.radius_m, 0.02);
    }
}

// The table with the objects and their shadows; the walls, the floor and the ceiling.
TEST(SyntheticImage, MatchesTheGoldenImage) {
  config::SyntheticWorld world;
  world.noise_sigma_levels = 0;
  std::vector<config::RigCamera> cameras;
  for (const Eigen::Vector3d& eye_world_m :
       {Eigen::Vector3d(-1.2, 0.8, 0.9), Eigen::Vector3d(0.9, 0.7, 0.5)})
    cameras.push_back(test::table_camera("table", eye_world_m, 160, 120));
  for (const Eigen::Vector3d& towards_m :
       {Eigen::Vector3d(2, 1, 1.2), Eigen::Vector3d(-2, -1, 0.2), Eigen::Vector3d(0.6, -2, 0.8),
        Eigen::Vector3d(-0.6, 2, -0.6)}) {
    cameras.push_back(test::table_camera("wall", {0, 0, 0.8}, 160, 120));
    cameras.back().camera_from_mount = geometry::look_at({0, 0, 0.8}, towards_m);
  }
  std::vector<cv::Mat> rows(2);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<cv::Mat> images;
    for (std::size_t k = 0; k < 3; ++k) images.push_back(image_of(world, cameras[3 * i + k], 25));
    cv::hconcat(images, rows[i]);
  }
  cv::Mat image;
  cv::vconcat(rows, image);
  // Another compiler may round differently, which moves the borders of the textures.
  test::expect_golden(image, "synthetic_room.png",
                      {.mean_levels = 0.05, .pixel_levels = 8, .wrong_pixels = 0.001});
}

TEST(SyntheticImage, DependsOnlyOnSeedCameraAndFrame) {
  const config::SyntheticWorld world;
  const config::RigCamera camera = test::table_cameras()[1];
  EXPECT_TRUE(same_bits(image_of(world, camera, 17), image_of(world, camera, 17)));
  SyntheticImageSource forth(world, camera, 30, {}, test::test_room());
  cv::Mat image;
  for (const int frame : {40, 3, 17}) forth.read(frame, image);
  EXPECT_TRUE(same_bits(image, image_of(world, camera, 17))) << "depends on the frames read before";
  EXPECT_FALSE(same_bits(image, image_of(world, camera, 18)));
  config::SyntheticWorld other = world;
  other.seed = 2;
  EXPECT_FALSE(same_bits(image, image_of(other, camera, 17)));
}

TEST(SyntheticImage, PrerenderedImagesAreIdentical) {
  config::SyntheticWorld world;
  world.period_s = 0.2;  // six frames
  const config::RigCamera camera = test::table_cameras()[1];
  SyntheticImageSource live(world, camera, 30, {}, test::test_room()),
      ahead(world, camera, 30, {}, test::test_room());
  ASSERT_TRUE(ahead.prerender());
  cv::Mat live_image, ahead_image;
  for (const int frame : {0, 5, 2}) {
    live.read(frame, live_image);
    ahead.read(frame, ahead_image);
    EXPECT_TRUE(same_bits(live_image, ahead_image)) << frame;
  }
}

TEST(SyntheticImage, IsPrerenderedOnlyIfItRepeatsWithAWholeNumberOfFrames) {
  config::SyntheticWorld world;
  world.period_s = 0.2;
  config::RigCamera camera = test::table_cameras()[1];
  const auto prerenders = [&](double frame_rate_hz) {
    const auto eye_at = [](double) { return Eigen::Isometry3d::Identity(); };
    return SyntheticImageSource(world, camera, frame_rate_hz, eye_at, test::test_room())
        .prerender();
  };
  EXPECT_TRUE(prerenders(10));
  EXPECT_FALSE(prerenders(12));  // 2.4 frames
  camera.mount = config::Mount::viewer;
  EXPECT_FALSE(prerenders(10));
}

TEST(SyntheticImage, HasTheConfiguredNoise) {
  for (const double sigma : {0.0, 1.0, 2.0, 5.0}) {
    cv::Mat image(200, 301, CV_8UC3, cv::Scalar(128, 128, 128));
    SensorNoise(sigma).add(image, 99);
    double sum = 0, squares = 0;
    const auto n = double(image.total() * 3);
    for (std::size_t i = 0; i < image.total() * 3; ++i) {
      sum += image.data[i] - 128;
      squares += (image.data[i] - 128.0) * (image.data[i] - 128.0);
    }
    const double expected =
        sigma > 0 ? std::sqrt(sigma * sigma + 1 / 12.0) : 0;  // rounding adds 1/12
    EXPECT_NEAR(sum / n, 0, 6 * expected / std::sqrt(n) + 1e-12);
    EXPECT_NEAR(std::sqrt(squares / n), expected, 6 * expected / std::sqrt(2 * n) + 1e-12);
  }
}

// Without noise and shadow, the image differs from the empty room only at true object pixels (rule
// `center`), and at nearly all of them.
TEST(SyntheticImage, MatchesAnalyticSilhouette) {
  config::SyntheticWorld world;
  world.noise_sigma_levels = 0;
  world.cast_shadow = false;
  config::RigCamera camera = test::table_cameras()[0];
  SyntheticImageSource source(world, camera, 30, {}, test::test_room());
  for (const int frame : {0, 25, 60, 100}) {
    cv::Mat image;
    source.read(frame, image);
    const cv::Mat room = source.background(0);
    const hull::ObjectPixels truth =
        hull::true_object_pixels(test::synthetic_object(world, frame / 30.0),
                                 config::published_camera(camera), hull::PixelRule::center);
    hull::ObjectPixels differs(720, 486);
    for (int v = 0; v < 486; ++v)
      for (int u = 0; u < 720; ++u)
        differs.set(u, v, image.at<cv::Vec3b>(v, u) != room.at<cv::Vec3b>(v, u));
    // Rays are rounded to float: 1e-4 px at the silhouette, 1 or 2 pixels of a contour of 1000.
    EXPECT_LE(test::count_not_in(differs, truth), 2u);
    EXPECT_LE(test::count_not_in(truth, differs), truth.count() / 1000);
  }
}

TEST(SyntheticImage, MatchesAnalyticSilhouetteAtImageBorder) {
  config::SyntheticWorld world;
  world.noise_sigma_levels = 0;
  world.cast_shadow = false;
  config::RigCamera camera = test::table_camera("close", {0.3, 0.6, 0.5}, 333, 250);
  camera.camera_from_mount = geometry::look_at({0.3, 0.6, 0.5}, {0.15, 0.0, 0.45});
  test::TestCamera eye(camera, world, {}, 1);
  bool cut = false;
  for (int frame = 0; frame < 120; frame += 15) {
    const hull::ObjectPixels touched =
        hull::true_object_pixels(test::synthetic_object(world, frame / 30.0),
                                 config::published_camera(camera), hull::PixelRule::touched);
    const hull::PixelRect bounds = touched.bounds();
    cut =
        cut || bounds.u0_px == 0 || bounds.v0_px == 0 || bounds.u1_px == 333 || bounds.v1_px == 250;
    EXPECT_EQ(test::count_not_in(eye.segment(frame), dilated(touched, 2)), 0u);
    EXPECT_LE(test::count_not_in(eroded(touched, 2), eye.segment(frame)), touched.count() / 200);
  }
  EXPECT_TRUE(cut);
}

// Maps with the rule `touched` are conservative: every object point that all cameras see is in the
// hull of the maps.
TEST(SyntheticWorld, IsInsideHullOfConservativeMasks) {
  const config::SyntheticWorld world;
  for (const double t_s : {0.4, 1.9, 3.3}) {
    const std::vector<hull::Capsule> object = test::synthetic_object(world, t_s);
    std::vector<hull::Silhouette> silhouettes;
    for (const config::RigCamera& camera : test::table_cameras())
      silhouettes.push_back({config::published_camera(camera),
                             hull::true_object_pixels(object, config::published_camera(camera),
                                                      hull::PixelRule::touched)});
    int checked = 0;
    for (const hull::Capsule& capsule : object)
      for (int i = 0; i < 60; ++i) {
        const double along = i / 59.0, turn = 2.4 * i;  // points on the surface, and inside
        const Eigen::Vector3d axis = (capsule.b_world_m - capsule.a_world_m).normalized(),
                              side = axis.unitOrthogonal();
        const Eigen::Vector3d p = capsule.a_world_m +
                                  along * (capsule.b_world_m - capsule.a_world_m) +
                                  capsule.radius_m * (i % 3) / 2.0 *
                                      (std::cos(turn) * side + std::sin(turn) * axis.cross(side));
        bool in_all = true;
        for (const hull::Silhouette& s : silhouettes) {
          const auto uv = geometry::project(s.camera, p);
          in_all = in_all && uv && uv->x() >= -0.5 && uv->y() >= -0.5 && uv->x() < 719.5 &&
                   uv->y() < 485.5;
        }
        if (!in_all) continue;
        ++checked;
        EXPECT_TRUE(hull::in_hull(silhouettes, p)) << p.transpose();
      }
    EXPECT_GT(checked, 500);
  }
}

}  // namespace
}  // namespace fivepipe::capture
