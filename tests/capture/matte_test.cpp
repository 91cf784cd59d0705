// Object pixels from masks, alpha channels and a coloured screen: exact if the input is exact.
#include <cmath>
#include <filesystem>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "capture_node/capture.h"
#include "capture_node/segmentation/image_mask.h"
#include "capture_node/segmentation/matte.h"
#include "common/hull/coverage/thin_coverage.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture {
namespace {

namespace fs = std::filesystem;

TEST(Matte, HalfWhiteAndHalfOpaqueAreObject) {
  cv::Mat mask(1, 256, CV_8UC1), colour(1, 256, CV_8UC3, cv::Scalar::all(255)),
      alpha(1, 256, CV_8UC4, cv::Scalar(255, 0, 0, 0));
  colour.setTo(0);
  for (int u = 0; u < 256; ++u) {
    mask.data[u] = colour.data[3 * u + u % 3] = alpha.data[4 * u + 3] = std::uint8_t(u);
  }
  hull::ObjectPixels expected(256, 1);
  expected.set_run(128, 256, 0);
  EXPECT_EQ(pixels_of_mask(mask), expected);
  EXPECT_EQ(pixels_of_mask(colour), expected);
  EXPECT_EQ(pixels_of_alpha(alpha), expected);
  EXPECT_EQ(pixels_of_mask(cv::Mat(0, 0, CV_8UC1)), hull::ObjectPixels());
}

TEST(Matte, TheirLevelsAreTheCoverage) {
  cv::Mat mask(2, 128, CV_8UC1), colour(2, 128, CV_8UC3, cv::Scalar::all(0)),
      alpha(2, 128, CV_8UC4, cv::Scalar(255, 255, 255, 0));
  for (int i = 0; i < 256; ++i)
    mask.data[i] = colour.data[3 * i + i % 3] = alpha.data[4 * i + 3] = std::uint8_t(i);
  for (const hull::CoverageMap& coverage :
       {coverage_of_mask(mask), coverage_of_mask(colour), coverage_of_alpha(alpha)}) {
    ASSERT_EQ(coverage.width_px(), 128);
    ASSERT_EQ(coverage.height_px(), 2);
    for (int i = 0; i < 256; ++i) EXPECT_EQ(coverage.at(i % 128, i / 128), i);
  }
}

cv::Vec3b bgr(double r, double g, double b) {
  return cv::Vec3b(std::uint8_t(std::lround(255 * b)), std::uint8_t(std::lround(255 * g)),
                   std::uint8_t(std::lround(255 * r)));
}

TEST(ChromaKey, TheScreenKeepsItsHueInLightAndShadow) {
  const auto is_object = [](const config::ChromaKey& key, const cv::Vec3b& level) {
    return ChromaKeyer(key).object_pixels(cv::Mat(1, 1, CV_8UC3, cv::Scalar(level))).count() == 1;
  };
  for (const std::array<double, 3>& rgb :
       {std::array{0.0, 1.0, 0.0}, {0.1, 0.7, 0.25}, {0.05, 0.2, 0.9}}) {
    const config::ChromaKey key{rgb, 30, 0.3};
    for (const double light : {0.35, 0.6, 1.0})
      EXPECT_FALSE(is_object(key, bgr(light * rgb[0], light * rgb[1], light * rgb[2]))) << light;
    EXPECT_TRUE(is_object(key, bgr(0.25 * rgb[0], 0.25 * rgb[1], 0.25 * rgb[2]))) << "too dark";
    for (const cv::Vec3b& other : {bgr(0.8, 0.6, 0.5), bgr(0.5, 0.5, 0.5), bgr(1, 1, 1),
                                   bgr(0, 0, 0), bgr(0.9, 0.1, 0.1), bgr(0.8, 0.1, 0.8)})
      EXPECT_TRUE(is_object(key, other)) << other;
  }
  // Angles from the key, at the same chroma: 20 and 40 degrees to both sides.
  const config::ChromaKey key{{0.2, 0.6, 0.2}, 30, 0.3};
  for (const double degrees : {-40.0, -20.0, 20.0, 40.0}) {
    const double cb = -0.1325, cr = -0.1675, a = degrees * std::numbers::pi / 180;
    const double x = cb * std::cos(a) - cr * std::sin(a), y = cb * std::sin(a) + cr * std::cos(a);
    const double luma = 0.45, r = luma + 1.402 * y, b = luma + 1.772 * x,
                 g = (luma - 0.299 * r - 0.114 * b) / 0.587;
    EXPECT_EQ(is_object(key, bgr(r, g, b)), std::abs(degrees) > 30) << degrees;
  }
}

// The true object pixels of a synthetic camera, in each of the four ways that a file can state
// them.
class CaptureWithMattes : public testing::Test {
 protected:
  static constexpr int kFrames = 3;

  CaptureWithMattes() {
    rig_.name = "one";
    rig_.volume_m = {Eigen::Vector3d(-0.6, -0.6, 0), Eigen::Vector3d(0.6, 0.6, 0.9)};
    viewer_.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
    rig_.cameras = {test::table_camera("cam", {-1.5, 0.9, 1.3}, 240, 162)};
    SyntheticImageSource source(world_, rig_.cameras[0], 30, {}, test::test_room());
    for (int frame = 0; frame < kFrames; ++frame) {
      cv::Mat image;
      source.read(frame, image);
      const hull::ObjectPixels object = hull::true_object_pixels(
          test::synthetic_object(world_, frame / 30.0), config::published_camera(rig_.cameras[0]),
          hull::PixelRule::center);
      truth_.push_back(object);
      cv::Mat mask(162, 240, CV_8UC1, cv::Scalar(0)), alpha(162, 240, CV_8UC4),
          screen = image.clone();
      for (int v = 0; v < 162; ++v)
        for (int u = 0; u < 240; ++u) {
          const bool is_object = object.contains(u, v);
          cv::Vec3b& pixel = screen.at<cv::Vec3b>(v, u);
          if (is_object) mask.at<std::uint8_t>(v, u) = 255;
          if (!is_object) pixel = {0, 255, 255};  // yellow: the person wears green
          alpha.at<cv::Vec4b>(v, u) = {image.at<cv::Vec3b>(v, u)[0], image.at<cv::Vec3b>(v, u)[1],
                                       image.at<cv::Vec3b>(v, u)[2],
                                       std::uint8_t(is_object ? 255 : 0)};
        }
      const std::string number = std::to_string(frame) + ".png";
      cv::imwrite((folder_.path / ("image" + number)).string(), image);
      cv::imwrite((folder_.path / ("mask" + number)).string(), mask);
      cv::imwrite((folder_.path / ("alpha" + number)).string(), alpha);
      cv::imwrite((folder_.path / ("screen" + number)).string(), screen);
    }
  }
  std::string file(const char* name) const {
    return (folder_.path / (std::string(name) + "%d.png")).string();
  }
  std::vector<CapturedCamera> capture(const char* images, const config::ObjectKey& key,
                                      int frame) const {
    config::CaptureConfig config;
    config.loop = false;
    config.sources["cam"] = config::VideoSource{file(images), key, 0};
    return Capture(rig_, viewer_, config, 30).capture(frame, true);
  }
  void expect_truth(const char* images, const config::ObjectKey& key) const {
    for (int frame = 0; frame < kFrames; ++frame) {
      const std::vector<CapturedCamera> found = capture(images, key, frame);
      ASSERT_EQ(found.size(), 1u);
      ASSERT_TRUE(found[0].pixels) << found[0].reason;
      EXPECT_EQ(*found[0].pixels, truth_[std::size_t(frame)]) << frame;
      ASSERT_TRUE(found[0].colour);
      const cv::Mat image =
          cv::imread((folder_.path / ("image" + std::to_string(frame) + ".png")).string());
      const hull::PixelRect& region = found[0].colour->region;
      std::size_t k = 0;
      for (int v = region.v0_px; v < region.v1_px; ++v)
        for (int u = region.u0_px; u < region.u1_px; ++u)
          for (int c = 0; c < 3; ++c, ++k)
            if (truth_[std::size_t(frame)].contains(u, v)) {
              ASSERT_EQ(found[0].colour->bgr[k], image.at<cv::Vec3b>(v, u)[c]) << u << ' ' << v;
            }
      EXPECT_GT(k, 300u);
    }
  }

  const test::TestFolder folder_;
  config::SyntheticWorld world_;
  config::Rig rig_;
  config::Viewer viewer_;
  std::vector<hull::ObjectPixels> truth_;
};

TEST_F(CaptureWithMattes, MasksAreTheMap) {
  expect_truth("image", config::MatteFile{file("mask")});
}
TEST_F(CaptureWithMattes, AlphaIsTheMap) { expect_truth("alpha", config::AlphaChannel{}); }
TEST_F(CaptureWithMattes, AScreenIsNoObject) {
  expect_truth("screen", config::ChromaKey{{1, 1, 0}, 30, 0.3});
}

// The levels of masks and alpha channels are the coverage, inside of the searched pixels. Without
// `coverage` there is none.
TEST_F(CaptureWithMattes, TheirLevelsAreTheCoverage) {
  const cv::Mat image = cv::imread((folder_.path / "image0.png").string());
  cv::Mat soft = cv::imread((folder_.path / "mask0.png").string(), cv::IMREAD_GRAYSCALE);
  cv::GaussianBlur(soft, soft, cv::Size(7, 7), 1.2);
  cv::imwrite((folder_.path / "soft0.png").string(), soft);
  cv::Mat alpha;
  cv::cvtColor(image, alpha, cv::COLOR_BGR2BGRA);
  cv::insertChannel(soft, alpha, 3);
  cv::imwrite((folder_.path / "softalpha0.png").string(), alpha);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.1, -0.1, 0.2), Eigen::Vector3d(0.1, 0.1, 0.3));
  hull::CoverageMap expected = coverage_of_mask(soft);
  expected.keep(pixels_of_volume(rig_.cameras[0], box));
  for (const auto& [images, key] : std::vector<std::pair<const char*, config::ObjectKey>>{
           {"image", config::MatteFile{file("soft")}}, {"softalpha", config::AlphaChannel{}}}) {
    config::CaptureConfig config;
    config.sources["cam"] = config::VideoSource{file(images), key, 0};
    config.segmentation.volume_m = box;
    EXPECT_FALSE(Capture(rig_, viewer_, config, 30).capture(0, false)[0].outline);
    config.coverage = true;
    const auto found = Capture(rig_, viewer_, config, 30).capture(0, false);
    ASSERT_TRUE(found[0].pixels && found[0].outline) << images;
    EXPECT_GT(found[0].outline->coverage.size(), 50u);
    EXPECT_EQ(*found[0].outline, hull::preserve_thin(expected).outline(*found[0].pixels)) << images;
  }
}

TEST_F(CaptureWithMattes, FaultsNameTheirCause) {
  fs::remove(folder_.path / "mask1.png");
  const auto gap = capture("image", config::MatteFile{file("mask")}, 1);
  EXPECT_EQ(gap[0].status, CaptureStatus::missing);
  EXPECT_NE(gap[0].reason.find("mask%d.png: frame 1 is missing"), std::string::npos)
      << gap[0].reason;
  fs::remove(folder_.path / "mask2.png");
  const auto end = capture("image", config::MatteFile{file("mask")}, 2);
  EXPECT_EQ(end[0].status, CaptureStatus::ended);
  EXPECT_EQ(end[0].reason, "the file of its masks has ended");
  const auto opaque = capture("image", config::AlphaChannel{}, 0);
  EXPECT_EQ(opaque[0].status, CaptureStatus::missing);
  EXPECT_EQ(opaque[0].reason, "the picture has no 8-bit alpha channel");
  EXPECT_THROW(capture("image", config::MatteFile{file("absent")}, 0), SourceError);
  cv::imwrite((folder_.path / "small0.png").string(), cv::Mat(10, 10, CV_8UC1, cv::Scalar(0)));
  EXPECT_THROW(capture("image", config::MatteFile{file("small")}, 0), SourceError);
}

// `volume_m` and `regions` apply to each way.
TEST_F(CaptureWithMattes, OnlySearchedPixelsAreObjects) {
  cv::Mat region(162, 240, CV_8UC1, cv::Scalar(0));
  region(cv::Rect(100, 0, 40, 162)).setTo(200);
  cv::imwrite((folder_.path / "region.png").string(), region);
  cv::imwrite(
      (folder_.path / "empty.png").string(),
      SyntheticImageSource(world_, rig_.cameras[0], 30, {}, test::test_room()).background(0));
  hull::ObjectPixels in_region(240, 162);
  for (int v = 0; v < 162; ++v) in_region.set_run(100, 140, v);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.1, -0.1, 0.2), Eigen::Vector3d(0.1, 0.1, 0.3));
  const hull::ObjectPixels in_volume = pixels_of_volume(rig_.cameras[0], box),
                           in_both = test::both(in_region, in_volume);
  ASSERT_GT(in_both.count(), 0u);
  ASSERT_LT(in_both.count(), std::min(in_region.count(), in_volume.count()));
  const auto found = [&](const char* images, const config::ObjectKey& key, bool has_region,
                         bool has_volume) {
    config::CaptureConfig config;
    config.sources["cam"] = config::VideoSource{file(images), key, 0};
    if (has_region) config.segmentation.regions["cam"] = (folder_.path / "region.png").string();
    if (has_volume) config.segmentation.volume_m = box;
    return *Capture(rig_, viewer_, config, 30).capture(0, false)[0].pixels;
  };
  const config::ObjectKey learned =
      config::LearnedBackground{(folder_.path / "empty.png").string()};
  for (const auto& [images, key] : std::vector<std::pair<const char*, config::ObjectKey>>{
           {"image", config::MatteFile{file("mask")}},
           {"alpha", config::AlphaChannel{}},
           {"screen", config::ChromaKey{{1, 1, 0}, 30, 0.3}}}) {
    EXPECT_EQ(found(images, key, true, false), test::both(truth_[0], in_region)) << images;
    EXPECT_EQ(found(images, key, false, true), test::both(truth_[0], in_volume)) << images;
    EXPECT_EQ(found(images, key, true, true), test::both(truth_[0], in_both)) << images;
  }
  const hull::ObjectPixels segmented = found("image", learned, true, true);
  EXPECT_GT(segmented.count(), 20u);
  EXPECT_EQ(test::count_not_in(segmented, in_both), 0u);
  cv::imwrite((folder_.path / "region.png").string(), cv::Mat(3, 3, CV_8UC1, cv::Scalar(1)));
  EXPECT_THROW(found("image", learned, true, false), SourceError);
  fs::remove(folder_.path / "region.png");
  EXPECT_THROW(found("image", learned, true, false), SourceError);
}

// Pictures and masks belong together by their number.
TEST_F(CaptureWithMattes, AMissingFirstMaskShiftsNoOther) {
  fs::remove(folder_.path / "mask0.png");
  const config::MatteFile masks{file("mask")};
  EXPECT_EQ(capture("image", masks, 0)[0].status, CaptureStatus::missing);
  for (const int frame : {1, 2})
    EXPECT_EQ(*capture("image", masks, frame)[0].pixels, truth_[std::size_t(frame)]) << frame;
  config::CaptureConfig config;
  config.sources["cam"] = config::VideoSource{file("image"), masks, 1};
  EXPECT_EQ(*Capture(rig_, viewer_, config, 30).capture(1, false)[0].pixels, truth_[2]);
}

// A camera that gives only colour may have pictures with an alpha channel.
TEST_F(CaptureWithMattes, AnAlphaChannelIsNoColour) {
  config::RigCamera colour = rig_.cameras[0];
  colour.name = "colour";
  colour.gives_shape = false;
  rig_.cameras.push_back(colour);
  config::CaptureConfig config;
  config.sources["cam"] = config::VideoSource{file("image"), config::MatteFile{file("mask")}, 0};
  config.sources["colour"] = config::VideoSource{file("alpha"), config::AlphaChannel{}, 0};
  const auto found = Capture(rig_, viewer_, config, 30).capture(0, true);
  ASSERT_EQ(found.size(), 2u);
  ASSERT_TRUE(found[0].colour && found[1].colour);
  const cv::Mat image = cv::imread((folder_.path / "image0.png").string());
  const hull::PixelRect& region = found[1].colour->region;
  std::size_t k = 0, compared = 0;
  for (int v = region.v0_px; v < region.v1_px; ++v)
    for (int u = region.u0_px; u < region.u1_px; ++u)
      for (int c = 0; c < 3; ++c, ++k)
        if (found[1].colour->pixels.contains(u, v)) {
          ASSERT_EQ(found[1].colour->bgr[k], image.at<cv::Vec3b>(v, u)[c]) << u << ' ' << v;
          ++compared;
        }
  EXPECT_GT(compared, 300u);
}

// No point of the volume projects outside the searched pixels, with and without a lens.
TEST(VolumeOfInterest, ContainsEveryPointOfTheVolume) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const config::RigCamera& camera : test::table_cameras()) {
    const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.2, -0.1, 0.05),
                                  Eigen::Vector3d(0.1, 0.3, 0.4));
    const hull::ObjectPixels pixels = pixels_of_volume(camera, box);
    EXPECT_GT(pixels.count(), 5000u);
    EXPECT_LT(pixels.count(), 720u * 486 / 2);
    const geometry::Camera published = config::published_camera(camera);
    const hull::ObjectPixels undistorted = Undistortion(camera).published(pixels);
    for (int i = 0; i < 20'000; ++i) {
      const Eigen::Vector3d p{box.min().x() + unit(random) * box.sizes().x(),
                              box.min().y() + unit(random) * box.sizes().y(),
                              box.min().z() + unit(random) * box.sizes().z()};
      const auto uv = geometry::project(published, p);
      ASSERT_TRUE(uv);
      ASSERT_TRUE(undistorted.contains_at(uv->x(), uv->y())) << camera.name << p.transpose();
    }
    // A tight box: its corners are not far inside the outline.
    const hull::ObjectPixels smaller = eroded(pixels, 2 * kVolumeMargin_px);
    int outside = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const auto uv =
          geometry::project(published, box.corner(Eigen::AlignedBox3d::CornerType(corner)));
      outside += !smaller.contains_at(uv->x(), uv->y());
    }
    if (camera.distortion.none()) {
      EXPECT_GE(outside, 4) << camera.name;
    }
  }
}

}  // namespace
}  // namespace fivepipe::capture
