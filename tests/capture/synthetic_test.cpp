#include <cmath>
#include <cstring>
#include <random>
#include <set>

#include "capture_node/lens/undistortion.h"
#include "capture_node/segmentation/coverage_estimate.h"
#include "capture_node/synthetic/noise/noise.h"
#include "capture_node/synthetic/shading.h"
#include "common/hull/hull.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/golden_image.h"

namespace fivepipe::capture {
namespace {

using test::capsule_of;

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

TEST(Noise, MatchesTheReferenceValuesOfSplitMix64) {
  // The first outputs of the generator with the seed 1234567.
  constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15u;
  std::uint64_t state = 1234567;
  for (const std::uint64_t expected :
       {6457827717110365317u, 3203168211198807973u, 9817491932198370423u, 4593380528125082431u}) {
    EXPECT_EQ(splitmix64(state), expected);
    state += kStep;
  }
  EXPECT_EQ(splitmix64(5, 7), splitmix64(splitmix64(5) ^ 7));
  EXPECT_EQ(unit_hash(1234567), float(6457827717110365317u >> 40) / float(1 << 24));
}

// Between the points of the lattice with the weights 3 t^2 - 2 t^3 along each axis.
TEST(Noise, InterpolatesItsLattice) {
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    double at[3], weight[3];
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = double(random() % 4000) / 200 - 10;  // also on the lattice's planes
      if (i % 3 == 0 && axis == 2) at[axis] = std::round(at[axis]);
      const double t = double(float(at[axis])) - std::floor(double(float(at[axis])));
      weight[axis] = t * t * (3 - 2 * t);
    }
    double expected = 0;
    for (int corner = 0; corner < 8; ++corner) {
      std::int64_t index[3];
      double share = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const int upper = corner >> axis & 1;
        index[axis] = std::int64_t(std::floor(double(float(at[axis])))) + upper;
        share *= upper ? weight[axis] : 1 - weight[axis];
      }
      expected += share * double(lattice(9, index[0], index[1], index[2]));
    }
    const float x = float(at[0]), y = float(at[1]), z = float(at[2]);
    ASSERT_NEAR(value_noise(9, x, y, z), expected, 1e-5) << x << ' ' << y << ' ' << z;
    double octaves = 0;
    for (int octave = 0; octave < 4; ++octave)
      octaves += std::pow(0.5, octave + 1) *
                 double(value_noise(9 + std::uint64_t(octave), std::ldexp(x, octave),
                                    std::ldexp(y, octave), std::ldexp(z, octave)));
    ASSERT_NEAR(fractal_noise(9, x, y, z), octaves / (15 / 16.0), 1e-5);
  }
  EXPECT_EQ(value_noise(9, 0.3f, 0.7f), value_noise(9, 0.3f, 0.7f, 0));
  EXPECT_EQ(fractal_noise(9, 0.3f, 0.7f), fractal_noise(9, 0.3f, 0.7f, 0));
}

TEST(Noise, LatticeHasAnotherNumberAtEachPointAndForEachSeed) {
  std::set<float> numbers;
  std::size_t points = 0;
  for (std::uint64_t seed = 100; seed < 103; ++seed)
    for (std::int64_t x = -2; x <= 2; ++x)
      for (std::int64_t y = -2; y <= 2; ++y)
        for (std::int64_t z = -2; z <= 2; ++z) {
          const float number = lattice(seed, x, y, z);
          ASSERT_TRUE(number >= 0 && number < 1);
          numbers.insert(number);
          ++points;
        }
  EXPECT_EQ(numbers.size(), points);
}

// The checksums of images with noise, also where it saturates.
TEST(Noise, SensorNoiseIsTheSameOnEveryMachine) {
  const auto checksum = [](double sigma_levels, int width_px, int height_px) {
    cv::Mat image(height_px, width_px, CV_8UC3, cv::Scalar(4, 128, 251));
    SensorNoise(sigma_levels).add(image, 77);
    std::uint64_t sum = 14695981039346656037u;  // FNV-1a
    for (std::size_t i = 0; i < image.total() * 3; ++i)
      sum = (sum ^ image.data[i]) * 1099511628211u;
    return sum;
  };
  EXPECT_EQ(checksum(2, 301, 40), 173139977320400772u);
  EXPECT_EQ(checksum(40, 301, 40), 13070869912412465819u);
  EXPECT_EQ(checksum(2, 400'000, 2), 8249078029974571225u) << "rows longer than half the table";
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

// Six pictures of lit textures: the four walls, the floor with the table's edge, and the table top.
TEST(SyntheticImage, SurfacesMatchTheGoldenImage) {
  constexpr int kSize_px = 128;
  const Eigen::Vector3f low(-2.9f, -2.7f, -0.75f), high(2.9f, 2.7f, 2.3f), eye(0.1f, 0.2f, 2.2f);
  std::vector<cv::Mat> pictures;
  for (int side = 0; side < 6; ++side) {
    cv::Mat picture(kSize_px, kSize_px, CV_8UC3);
    for (int v = 0; v < kSize_px; ++v)
      for (int u = 0; u < kSize_px; ++u) {
        const float s = (float(u) + 0.4f) / kSize_px, t = (float(v) + 0.3f) / kSize_px;
        Eigen::Vector3f p;
        if (side < 4) {  // walls
          const int axis = side / 2;
          p = low + s * (high - low);
          p[axis] = side % 2 ? high[axis] : low[axis];
          p.z() = high.z() + t * (low.z() - high.z());
        } else if (side == 4) {  // the floor around the table, and the table's edge
          p = {low.x() + s * (high.x() - low.x()), low.y() + t * (high.y() - low.y()), low.z()};
        } else {  // the table
          p = {-0.85f + 1.7f * s, -0.68f + 1.36f * t, 0};
        }
        const Eigen::Vector3f bgr = test::test_room()->trace_ray(eye, p - eye).bgr;
        for (int c = 0; c < 3; ++c)
          picture.at<cv::Vec3b>(v, u)[c] = cv::saturate_cast<std::uint8_t>(bgr[c]);
      }
    pictures.push_back(picture);
  }
  cv::Mat image;
  cv::hconcat(pictures, image);
  test::expect_golden(image, "synthetic_surfaces.png",
                      {.mean_levels = 0.01, .pixel_levels = 2, .wrong_pixels = 0.0002});
}

// The hand and the pipe from above, from below and from the side, and a camera on the viewer. The
// size is odd, and the third camera has distortion.
TEST(SyntheticImage, CloseViewsMatchTheGoldenImage) {
  config::SyntheticWorld world;
  world.noise_sigma_levels = 0;
  const Eigen::Vector3d palm = test::synthetic_object(world, 25 / 30.0)[1].a_world_m;
  std::vector<cv::Mat> images;
  for (const Eigen::Vector3d& offset_m :
       {Eigen::Vector3d(0.1, 0.22, 0.25), Eigen::Vector3d(-0.12, 0.2, -0.1),
        Eigen::Vector3d(-0.3, -0.1, 0.1), Eigen::Vector3d(0.2, -0.7, 0.5)}) {
    config::RigCamera camera = test::table_camera("close", palm + offset_m, 159, 121);
    camera.camera_from_mount = geometry::look_at(palm + offset_m, palm);
    if (images.size() == 2) camera.distortion = {-0.25, 0.08, 0.0005, -0.0003, 0};
    SyntheticImageSource::EyePath eye_at;
    if (images.size() == 3) {
      camera.mount = config::Mount::viewer;
      eye_at = [pose = camera.camera_from_mount](double) { return pose; };
      camera.camera_from_mount =
          Eigen::Translation3d(0.02, 0.01, 0) * Eigen::Isometry3d::Identity();
    }
    SyntheticImageSource source(world, camera, 30, eye_at, test::test_room());
    images.emplace_back();
    source.read(25, images.back());
  }
  cv::Mat image;
  cv::hconcat(images, image);
  test::expect_golden(image, "synthetic_hand.png",
                      {.mean_levels = 0.01, .pixel_levels = 2, .wrong_pixels = 0.0002});
}

// Compares with a rendering that tests every part at every pixel.
TEST(SyntheticImage, EqualsARenderingWithoutBounds) {
  config::SyntheticWorld world;
  std::vector<config::RigCamera> cameras;
  for (const auto& [eye_m, target_m] : std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>{
           {{-0.6, 0.5, 0.7}, {0, 0, 0.1}},           // the objects and their shadow on the table
           {{0.25, -0.62, 0.45}, {0.1, 0.0, 0.25}},   // the sleeve passes below and behind it
           {{0.2, -2.3, 0.9}, {0.1, -0.9, -0.4}}}) {  // the shadow on the floor
    cameras.push_back(test::table_camera("any", eye_m, 120, 90));
    cameras.back().camera_from_mount = geometry::look_at(eye_m, target_m);
  }
  cameras[0].distortion = {-0.25, 0.08, 0.0005, -0.0003, 0};
  std::size_t drawn = 0, shaded_on_table = 0, shaded_on_floor = 0, different = 0, values = 0;
  for (const config::RigCamera& camera : cameras) {
    const double t_s = &camera == &cameras[0] ? 2.9 : 0.5;
    SyntheticCamera renderer(world, camera, test::test_room());
    const Eigen::Isometry3d& camera_from_world = camera.camera_from_mount;
    const Eigen::Isometry3d world_from_camera = camera_from_world.inverse(Eigen::Isometry);
    const std::vector<SyntheticPart> parts = synthetic_parts(world, t_s);
    const cv::Mat room = renderer.image({}, camera_from_world),
                  image = renderer.image(parts, camera_from_world);
    // Pieces of at most three radii: the penumbra is that of a piece.
    std::vector<hull::Capsule> pieces;
    for (const SyntheticPart& part : parts) {
      const Eigen::Vector3d a = capsule_of(part).a_world_m, along = capsule_of(part).b_world_m - a;
      const int n = int(std::ceil(along.norm() / (3 * capsule_of(part).radius_m)));
      for (int i = 0; i < n; ++i)
        pieces.push_back({a + along * i / n, a + along * (i + 1) / n, capsule_of(part).radius_m});
    }
    for (int v = 0; v < image.rows; ++v)
      for (int u = 0; u < image.cols; ++u) {
        const Eigen::Vector2f xy =
            geometry::undistorted(camera.source, camera.distortion, {u, v}).cast<float>();
        const geometry::Ray ray{
            world_from_camera.translation(),
            world_from_camera.linear() * Eigen::Vector3d(double(xy.x()), double(xy.y()), 1)};
        const Eigen::Vector3f origin = ray.origin_world_m.cast<float>(),
                              direction = ray.direction_world.cast<float>();
        const cv::Vec3b room_bgr = room.at<cv::Vec3b>(v, u);
        Eigen::Vector3f expected(room_bgr[0], room_bgr[1], room_bgr[2]);
        const Surface surface = test::test_room()->trace_ray(origin, direction).surface;
        if (surface != Surface::other) {
          const float z_m = surface == Surface::table_top ? 0.0f : -0.75f;
          const Eigen::Vector3f p = origin + (z_m - origin.z()) / direction.z() * direction;
          float visible = 1;
          for (const hull::Capsule& piece : pieces)
            visible = std::min(visible, lamp_visibility_past(piece, p));
          const Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
          expected *= brightness(p, up, visible) / brightness(p, up, 1);
          (surface == Surface::floor ? shaded_on_floor : shaded_on_table) += visible < 0.5f;
        }
        double nearest = INFINITY;
        for (const SyntheticPart& part : parts)
          if (const auto depth = hull::ray_entry(capsule_of(part), ray);
              depth && *depth < nearest) {
            nearest = *depth;
            expected =
                shaded(part, ray.origin_world_m + *depth * ray.direction_world, ray.origin_world_m);
          }
        drawn += nearest < INFINITY;
        for (int c = 0; c < 3; ++c, ++values)
          different += std::abs(float(image.at<cv::Vec3b>(v, u)[c]) -
                                std::clamp(expected[c], 0.0f, 255.0f)) > 1.5f;
      }
  }
  EXPECT_GT(drawn, 2000u);
  EXPECT_GT(shaded_on_table, 500u);
  EXPECT_GT(shaded_on_floor, 200u);
  // Rounding to float moves edges of the texture of a part.
  EXPECT_LE(different, values / 2000);
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
  for (const int frame : {0, 5, 2, 6, 13, 6001}) {
    live.read(frame, live_image);
    ahead.read(frame, ahead_image);
    EXPECT_TRUE(same_bits(live_image, ahead_image)) << frame;
  }
}

// No two images have the same noise: neither images of the scene and of the empty room, nor those
// of two cameras.
TEST(SyntheticImage, EveryImageHasItsOwnNoise) {
  config::SyntheticWorld world;
  world.noise_sigma_levels = 20;
  std::vector<cv::Mat> corners;  // the scene changes only far from them
  for (const char* name : {"ab", "ba", "b"}) {
    SyntheticImageSource source(world, test::table_camera(name, {-1.5, 0.9, 1.3}, 64, 48), 30, {},
                                test::test_room());
    for (int i = 0; i < 6; ++i) {
      cv::Mat image;
      source.read(i, image);
      for (const cv::Mat& one : {image, source.background(i)})
        corners.push_back(one(cv::Rect(0, 0, 30, 6)).clone());
    }
  }
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_FALSE(same_bits(corners[i], corners[k])) << i << ' ' << k;
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
  EXPECT_FALSE(prerenders(12));         // 2.4 frames
  EXPECT_TRUE(prerenders(10 + 3e-6));   // 0.6e-6 frames too many
  EXPECT_FALSE(prerenders(10 + 8e-6));  // 1.6e-6
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

// Root mean square error of the coverage that is estimated from the image of a camera, in the
// pixels that the object covers in part.
double coverage_error(const config::SyntheticWorld& world) {
  const config::RigCamera camera = test::table_cameras()[0];
  SyntheticImageSource source(world, camera, 30, {}, test::test_room());
  cv::Mat image, room;
  source.read(25, image);
  source.background(0).convertTo(room, CV_32FC3);
  const auto object = test::synthetic_object(world, 25 / 30.0);
  const geometry::Camera published = config::published_camera(camera);
  const hull::CoverageMap truth = hull::true_coverage(object, published),
                          found = estimated_coverage(
                              image,
                              hull::true_object_pixels(object, published, hull::PixelRule::touched),
                              {{room.ptr<float>(), room.total() * 3}});
  double sum = 0;
  int count = 0;
  for (int v = 0; v < 486; ++v)
    for (int u = 0; u < 720; ++u)
      if (const int coverage = truth.at(u, v); coverage > 0 && coverage < 255) {
        sum += std::pow((found.at(u, v) - coverage) / 255.0, 2);
        ++count;
      }
  EXPECT_GT(count, 300);
  return std::sqrt(sum / count);
}

TEST(SyntheticImage, ASupersampledOutlineIsAMixtureByCoverage) {
  config::SyntheticWorld world;
  world.noise_sigma_levels = 0;
  world.cast_shadow = false;
  EXPECT_GT(coverage_error(world), 0.2) << "one ray per pixel";
  world.supersampling = 4;
  EXPECT_LT(coverage_error(world), 0.1);
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
