#include "capture_node/capture.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <set>
#include <stdexcept>

#include "capture_node/object_colour.h"
#include "common/base/realtime.h"
#include "common/geometry/lens.h"
#include "common/hull/cpu/cpu_hull.h"
#include "common/hull/oracle/analytic.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture {
namespace {

config::Rig table_rig() {
  config::Rig rig;
  rig.name = "test";
  rig.volume_m =
      Eigen::AlignedBox3d(Eigen::Vector3d(-0.75, -0.6, 0), Eigen::Vector3d(0.75, 0.6, 0.9));
  for (const Eigen::Vector3d& eye :
       {Eigen::Vector3d(-1.5, 0.9, 1.3), Eigen::Vector3d(1.5, 0.9, 1.3)})
    rig.cameras.push_back(
        test::table_camera("cam" + std::to_string(rig.cameras.size()), eye, 240, 162));
  config::RigCamera on_viewer = test::table_camera("hmd", {0, 0, 0}, 160, 120);
  on_viewer.camera_from_mount.setIdentity();
  on_viewer.mount = config::Mount::viewer;
  on_viewer.gives_shape = false;
  rig.cameras.push_back(on_viewer);
  return rig;
}

config::Viewer test_viewer() {
  config::Viewer viewer;
  viewer.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}, {2, {0.2, -0.8, 0.8}, {0, 0, 0.2}}};
  return viewer;
}

config::CaptureConfig synthetic_config(const config::Rig& rig) {
  config::CaptureConfig config;
  for (const config::RigCamera& camera : rig.cameras)
    config.sources[camera.name] = config::SyntheticSource{};
  return config;
}

// The files have three and five frames. When the first ends, both restart, so that a set never
// combines different frames.
TEST(Capture, FilesOfUnequalLengthRestartTogether) {
  const test::TestFolder folder;
  config::Rig rig = table_rig();
  rig.cameras.pop_back();  // the camera on the viewer
  for (const int precomputed : {0, 7}) {
    config::CaptureConfig config;
    config.precomputed_frames = precomputed;
    for (std::size_t i = 0; i < 2; ++i) {
      const std::filesystem::path of_camera = folder.path / rig.cameras[i].name;
      std::filesystem::create_directories(of_camera);
      cv::imwrite((of_camera / "empty.png").string(),
                  cv::Mat(162, 240, CV_8UC3, cv::Scalar::all(60)));
      for (int frame = 0; frame < (i == 0 ? 3 : 5); ++frame) {  // frame k shows a square at 40 k px
        cv::Mat image(162, 240, CV_8UC3, cv::Scalar::all(60));
        image(cv::Rect(40 * frame, 50, 30, 30)).setTo(cv::Scalar(0, 0, 250));
        cv::imwrite((of_camera / ("f" + std::to_string(frame) + ".png")).string(), image);
      }
      config.sources[rig.cameras[i].name] =
          config::VideoSource{(of_camera / "f%d.png").string(),
                              config::LearnedBackground{(of_camera / "empty.png").string()}, 0};
    }
    Capture capture(rig, test_viewer(), config, 30);
    for (int frame = 0; frame < 7; ++frame) {
      const auto set = capture.capture(frame, false);
      for (const CapturedCamera& camera : set)
        EXPECT_EQ(camera.pixels.value().bounds().u0_px / 40, frame % 3)
            << camera.camera << " at " << frame;
    }
    EXPECT_FALSE(capture.ended());
  }
}

// Pictures of 240x162 px for two cameras: frame k shows a square at 40 k px on grey.
class CapturePictures : public testing::Test {
 protected:
  CapturePictures() {
    rig_.cameras.pop_back();  // the camera on the viewer
    for (const config::RigCamera& camera : rig_.cameras) add_source(camera.name);
  }
  void add_source(const std::string& camera) {
    std::filesystem::create_directories(folder_ / camera);
    cv::imwrite((folder_ / camera / "empty.png").string(), room());
    config_.sources[camera] = config::VideoSource{
        (folder_ / camera / "f%d.png").string(),
        config::LearnedBackground{(folder_ / camera / "empty.png").string()}, 0};
  }
  // Adds cam2.
  void add_camera() {
    rig_.cameras.push_back(test::table_camera("cam2", {0, -1.8, 1.3}, 240, 162));
    add_source("cam2");
  }
  static cv::Mat room() { return {162, 240, CV_8UC3, cv::Scalar::all(60)}; }
  void write(const std::string& camera, int frame) const {
    cv::Mat image = room();
    image(cv::Rect(40 * frame, 50, 30, 30)).setTo(cv::Scalar(0, 0, 250));
    cv::imwrite((folder_ / camera / ("f" + std::to_string(frame) + ".png")).string(), image);
  }

  config::Rig rig_ = table_rig();
  config::CaptureConfig config_;
  const test::TestFolder test_folder_;
  const std::filesystem::path folder_ = test_folder_.path;
};

TEST_F(CapturePictures, AMissingPictureIsNamedAndTheOtherCamerasGoOn) {
  for (const int frame : {0, 1, 2, 3}) write("cam0", frame);
  for (const int frame : {0, 2, 3}) write("cam1", frame);
  Capture capture(rig_, test_viewer(), config_, 30);
  const std::int64_t before_ns = base::now_realtime_ns();
  const auto set = capture.capture(1, true);
  EXPECT_EQ(set[0].status, CaptureStatus::captured);
  EXPECT_EQ(set[0].reason, "");
  EXPECT_EQ(set[0].pixels.value().bounds(), (hull::PixelRect{40, 50, 70, 80}));
  EXPECT_EQ(set[0].colour.value().pixels, *set[0].pixels);
  EXPECT_GT(set[0].read_s, 0);
  EXPECT_GT(set[0].segment_s, 0);
  EXPECT_GT(set[0].segment_cpu_s, 0);
  EXPECT_LE(set[0].segment_cpu_s, set[0].segment_s + 1e-3);
  EXPECT_EQ(set[1].status, CaptureStatus::missing);
  EXPECT_NE(set[1].reason.find("frame 1 is missing or cannot be decoded"), std::string::npos)
      << set[1].reason;
  EXPECT_FALSE(set[1].pixels);
  EXPECT_FALSE(set[1].colour);
  EXPECT_GT(set[1].read_s, 0);
  EXPECT_EQ(set[1].segment_s, 0);
  for (const CapturedCamera& camera : set) {
    EXPECT_GE(camera.image_stamp_ns, before_ns);
    EXPECT_LE(camera.image_stamp_ns, base::now_realtime_ns());
    EXPECT_EQ(camera.image_stamp_ns, set[0].image_stamp_ns) << "files have no clock";
  }
  EXPECT_FALSE(capture.ended());
  EXPECT_EQ(capture.capture(2, false)[1].status, CaptureStatus::captured);
}

// Every pixel of the missing picture is an object pixel; the colours of the other cameras go on.
TEST_F(CapturePictures, GoesOnWithoutAMissingPictureIfConfigured) {
  add_camera();
  for (const int frame : {0, 1, 2}) write("cam0", frame);
  for (const int frame : {0, 2}) write("cam1", frame);
  for (const int frame : {0, 1, 2}) write("cam2", frame);
  config_.lost_camera = config::LostCamera::go_on;
  Capture capture(rig_, test_viewer(), config_, 30);
  const auto set = capture.capture(1, true);
  EXPECT_EQ(set[1].status, CaptureStatus::missing);
  EXPECT_NE(set[1].reason.find("; the hull goes on without it"), std::string::npos)
      << set[1].reason;
  EXPECT_EQ(set[1].pixels.value().count(), 240u * 162u);
  EXPECT_EQ(set[1].image_stamp_ns, set[0].image_stamp_ns) << "adds nothing to the skew";
  EXPECT_FALSE(set[1].colour);
  EXPECT_TRUE(set[1].diagnostics.empty());
  EXPECT_EQ(set[0].colour.value().pixels, *set[0].pixels);
  EXPECT_EQ(capture.capture(2, false)[1].pixels.value().bounds(),
            (hull::PixelRect{80, 50, 110, 80}));
}

// With Limits::seen, a full map would be an object everywhere.
TEST_F(CapturePictures, ALostCameraHasNoMapIfTheCamerasThatSeeLimitTheHull) {
  add_camera();
  for (const int frame : {0, 1, 2}) write("cam0", frame);
  for (const int frame : {0, 2}) write("cam1", frame);
  for (const int frame : {0, 1, 2}) write("cam2", frame);
  config_.lost_camera = config::LostCamera::go_on;
  config_.hull_rule.limits = hull::Limits::seen;
  Capture capture(rig_, test_viewer(), config_, 30);
  const auto set = capture.capture(1, false);
  EXPECT_FALSE(set[1].pixels);
  EXPECT_NE(set[1].reason.find("; the hull goes on without it"), std::string::npos);
  EXPECT_TRUE(set[0].pixels && set[2].pixels);
}

TEST(Capture, StampOfASetIsThatOfItsEarliestImage) {
  std::vector<CapturedCamera> set(4);
  EXPECT_EQ(earliest_stamp_ns(set), std::nullopt);
  set[0].image_stamp_ns = 7;
  set[0].status = CaptureStatus::missing;
  EXPECT_EQ(earliest_stamp_ns(set), std::nullopt);
  set[1].image_stamp_ns = 9;
  set[2].image_stamp_ns = 8;
  set[3].image_stamp_ns = 10;
  EXPECT_EQ(earliest_stamp_ns(set), 8);
}

// Files and cameras without an image are neither late, nor are others late because of them.
TEST(Capture, NamesTheCamerasWhoseImagesAreLate) {
  constexpr std::int64_t kNow_ns = 1'000'000'000'000, kMs_ns = 1'000'000;
  std::vector<CapturedCamera> set(6);
  for (std::size_t camera = 0; camera < 5; ++camera) set[camera].has_clock = true;
  set[0].image_stamp_ns = kNow_ns;
  set[1].image_stamp_ns = kNow_ns - 49 * kMs_ns;  // 1.5 periods are 50 ms
  set[2].image_stamp_ns = kNow_ns - 51 * kMs_ns;
  set[3].image_stamp_ns = kNow_ns + 900 * kMs_ns;
  set[3].status = CaptureStatus::missing;
  set[4].image_stamp_ns = 0;                       // nothing was read
  set[5].image_stamp_ns = kNow_ns - 900 * kMs_ns;  // of a file
  name_late_cameras(set, 30);
  for (const std::size_t camera : {0, 1, 3, 4, 5})
    EXPECT_TRUE(set[camera].diagnostics.empty()) << camera;
  EXPECT_EQ(set[2].diagnostics,
            std::vector<std::string>{"late: its image is more than 1.5 frame periods older than "
                                     "those of other cameras"});
}

// One camera bounds no hull.
TEST_F(CapturePictures, DoesNotGoOnWithOneCamera) {
  write("cam0", 0), write("cam0", 1), write("cam0", 2);
  write("cam1", 0), write("cam1", 2);
  config_.lost_camera = config::LostCamera::go_on;
  Capture capture(rig_, test_viewer(), config_, 30);
  const auto set = capture.capture(1, false);
  EXPECT_EQ(set[1].status, CaptureStatus::missing);
  EXPECT_FALSE(set[1].pixels);
  EXPECT_NE(set[1].reason.find("; too few cameras have an image for a hull"), std::string::npos)
      << set[1].reason;
  // Another node reads cam0, and may have its image.
  config_.sources.erase("cam0");
  Capture of_node(rig_, test_viewer(), config_, 30);
  EXPECT_EQ(of_node.capture(1, false)[0].pixels.value().count(), 240u * 162u);
}

// No picture arrives later.
TEST_F(CapturePictures, DoesNotWaitForAMissingPicture) {
  for (const int frame : {0, 1}) write("cam0", frame);
  for (const int frame : {0, 2}) write("cam1", frame);
  config_.lost_camera = config::LostCamera::wait;
  Capture capture(rig_, test_viewer(), config_, 30);
  capture.set_go_on_waiting([](const std::string&, const std::string&) { return true; });
  const auto set = capture.capture(1, false);
  EXPECT_EQ(set[1].status, CaptureStatus::missing);
  EXPECT_FALSE(set[1].pixels);
}

TEST_F(CapturePictures, ObjectPixelsOutsideThePublishedImageAreReported) {
  for (const int frame : {0, 1}) {
    write("cam0", frame);
    write("cam1", frame);
  }
  geometry::Pinhole& published = rig_.cameras[0].published;
  published.width_px = 60;  // the square of picture 1 is at 40 to 70
  Capture capture(rig_, test_viewer(), config_, 30);
  const auto set = capture.capture(1, false);
  ASSERT_EQ(set[0].diagnostics.size(), 1u);
  EXPECT_NE(set[0].diagnostics[0].find("outside the published image"), std::string::npos);
  EXPECT_TRUE(set[1].diagnostics.empty());
}

TEST_F(CapturePictures, WithoutLoopItEndsWithTheShortestFile) {
  for (const int frame : {0, 1, 2}) write("cam0", frame);
  for (const int frame : {0, 1}) write("cam1", frame);
  config_.loop = false;
  Capture capture(rig_, test_viewer(), config_, 30);
  capture.capture(1, false);
  EXPECT_FALSE(capture.ended());
  const auto set = capture.capture(2, false);
  EXPECT_TRUE(capture.ended());
  EXPECT_EQ(set[0].status, CaptureStatus::captured);
  EXPECT_EQ(set[1].status, CaptureStatus::ended);
  EXPECT_EQ(set[1].reason, "its images have ended");
  EXPECT_FALSE(set[1].pixels);
}

// The frame at which a file ends is not one of them.
TEST_F(CapturePictures, WithoutLoopThePrecomputedFramesEndWithTheShortestFile) {
  for (const int frame : {0, 1, 2}) write("cam0", frame);
  for (const int frame : {0, 1}) write("cam1", frame);
  config_.loop = false;
  config_.precomputed_frames = 9;
  std::vector<std::string> steps;
  Capture capture(rig_, test_viewer(), config_, 30,
                  [&](std::string_view what, double) { steps.emplace_back(what); });
  for (int frame = 0; frame < 6; ++frame)
    for (const CapturedCamera& camera : capture.capture(frame, false)) {
      ASSERT_TRUE(camera.pixels) << camera.camera << " at " << frame;
      EXPECT_EQ(camera.pixels->bounds().u0_px / 40, frame % 2);
      EXPECT_EQ(camera.read_s, 0);
      EXPECT_EQ(camera.segment_s, 0);
    }
  EXPECT_FALSE(capture.ended());
  EXPECT_EQ(std::count(steps.begin(), steps.end(), "precomputing frames"), 2);
}

// A lower frame number begins at the first pictures again, also after a restart of the files.
TEST_F(CapturePictures, ALowerFrameNumberReadsItsOwnPictures) {
  for (const std::string camera : {"cam0", "cam1"})
    for (const int frame : {0, 1, 2}) write(camera, frame);
  Capture capture(rig_, test_viewer(), config_, 30);
  const auto shown = [&](int frame) {
    return capture.capture(frame, false)[0].pixels.value().bounds().u0_px / 40;
  };
  EXPECT_EQ(shown(2), 2);
  EXPECT_EQ(shown(3), 0);  // the files restart at frame 3
  EXPECT_EQ(shown(5), 2);
  EXPECT_EQ(shown(1), 1);
  EXPECT_EQ(shown(2), 2);
}

// A node that skips frames or starts late shows the same pictures as one that does not.
TEST_F(CapturePictures, TheFrameNumberAloneSelectsThePictures) {
  for (const std::string camera : {"cam0", "cam1"})
    for (const int frame : {0, 1, 2}) write(camera, frame);
  write("cam0", 3);
  for (const std::vector<int>& frames :
       {std::vector{0, 1, 5, 6}, std::vector{2, 4, 7}, std::vector{1000}, std::vector{1001, 3}}) {
    Capture capture(rig_, test_viewer(), config_, 30);
    for (const int frame : frames)
      for (const CapturedCamera& camera : capture.capture(frame, false))
        EXPECT_EQ(camera.pixels.value().bounds().u0_px / 40, frame % 3) << frame;
  }
}

TEST_F(CapturePictures, AnErrorOfTheDecoderNamesTheCamera) {
  for (const std::string camera : {"cam0", "cam1"}) write(camera, 0);
  // OpenCV throws if the header of a picture names a size beyond its limit.
  std::ofstream(folder_ / "cam1" / "huge.ppm") << "P6 2000000 1 255\n";
  config_.sources["cam1"] = config::VideoSource{(folder_ / "cam1" / "huge.ppm").string(), {}, 0};
  try {
    Capture capture(rig_, test_viewer(), config_, 30);
    FAIL() << "no error";
  } catch (const SourceError& error) {
    ASSERT_EQ(error.problems().size(), 1u);
    EXPECT_EQ(error.problems()[0].camera, "cam1");
    EXPECT_EQ(error.problems()[0].fault, SourceFault::not_decodable);
    EXPECT_NE(error.problems()[0].what.find("OpenCV"), std::string::npos) << error.what();
  }
}

// One pixel of the object is enough for a colour.
TEST_F(CapturePictures, ASinglePixelHasItsColour) {
  config_.segmentation.min_object_px = 0;
  for (const std::string camera : {"cam0", "cam1"}) {
    cv::Mat image = room();
    image.at<cv::Vec3b>(60, 70) = cv::Vec3b(10, 20, 250);
    cv::imwrite((folder_ / camera / "f0.png").string(), image);
  }
  Capture capture(rig_, test_viewer(), config_, 30);
  for (const CapturedCamera& camera : capture.capture(0, true)) {
    ASSERT_TRUE(camera.colour);
    EXPECT_EQ(camera.colour->region, (hull::PixelRect{70, 60, 71, 61}));
    EXPECT_EQ(camera.colour->bgr, (std::vector<std::uint8_t>{10, 20, 250}));
  }
}

TEST_F(CapturePictures, FramesOfAnyRoundMayComeInAnyOrder) {
  for (const std::string camera : {"cam0", "cam1"})
    for (const int frame : {0, 1, 2}) write(camera, frame);
  Capture capture(rig_, test_viewer(), config_, 30);
  std::vector<int> shown;
  for (const int frame : {0, 1, 2, 3, 3, 4, 4, 7, 8, 7, 0, 1, 3, 2})
    shown.push_back(capture.capture(frame, false)[0].pixels.value().bounds().u0_px / 40);
  EXPECT_EQ(shown, (std::vector<int>{0, 1, 2, 0, 0, 1, 1, 1, 2, 1, 0, 1, 0, 2}));
}

TEST_F(CapturePictures, CamerasThatGiveNoColourHaveNone) {
  for (const std::string camera : {"cam0", "cam1"}) write(camera, 0);
  rig_.cameras[1].gives_colour = false;
  Capture capture(rig_, test_viewer(), config_, 30);
  const auto set = capture.capture(0, true);
  EXPECT_TRUE(set[0].colour);
  EXPECT_TRUE(set[1].pixels);
  EXPECT_FALSE(set[1].colour);
}

// A camera that gives no shape sends colours of the pixels that its captured image sees only, and
// is read only if a node wants colour.
TEST(Capture, ColourOfACameraWithoutShapeIsThatOfItsImage) {
  config::Rig rig = table_rig();
  config::RigCamera& on_viewer = rig.cameras[2];
  // The published image is wider than the captured one.
  on_viewer.published = geometry::pinhole_from_fov(160, 120, 1.4);
  Capture capture(rig, test_viewer(), synthetic_config(rig), 30);
  const auto set = capture.capture(5, true);
  const Undistortion undistortion(on_viewer);
  ASSERT_TRUE(set[2].colour);
  const hull::ColourRegion& colour = *set[2].colour;
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 160; ++u)
      if (colour.pixels.contains(u, v)) {
        ASSERT_TRUE(undistortion.sees(u, v)) << u << ' ' << v;
      }
  EXPECT_LT(colour.region.width_px(), 140);
  const auto without = capture.capture(6, false);
  EXPECT_EQ(without[2].image_stamp_ns, 0);
  EXPECT_EQ(without[2].read_s, 0);
  EXPECT_EQ(without[2].status, CaptureStatus::captured);
}

TEST(Capture, ReturnsPixelsAndColourInRigOrder) {
  const config::Rig rig = table_rig();
  std::vector<double> fractions;
  Capture capture(rig, test_viewer(), synthetic_config(rig), 30,
                  [&](std::string_view, double fraction) { fractions.push_back(fraction); });
  ASSERT_EQ(fractions.size(), 3u);
  EXPECT_EQ(fractions.back(), 1.0);
  const std::vector<CapturedCamera> set = capture.capture(10, true);
  ASSERT_EQ(set.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(set[i].camera, rig.cameras[i].name);
    EXPECT_EQ(set[i].status, CaptureStatus::captured);
    EXPECT_EQ(set[i].pixels.has_value(), rig.cameras[i].gives_shape);
    ASSERT_TRUE(set[i].colour);
    EXPECT_EQ(set[i].colour->bgr.size(), 3 * set[i].colour->region.area_px());
    EXPECT_EQ(set[i].colour->region, set[i].colour->pixels.bounds());
    if (set[i].pixels) {
      EXPECT_EQ(set[i].colour->pixels, *set[i].pixels);
    }
    EXPECT_TRUE(set[i].diagnostics.empty());
  }
  const geometry::Camera eye =
      config::published_camera(rig.cameras[2], config::eye_from_world_at(test_viewer(), 10 / 30.0));
  EXPECT_TRUE(set[2].colour->camera.camera_from_world.isApprox(eye.camera_from_world));
  // The colour contains every pixel that shows the hull of the two other cameras' maps, and its
  // neighbours. It has fewer pixels than the bounds of either map alone would give.
  base::WorkerPool pool(1);
  const std::vector<hull::Silhouette> silhouettes = {
      {config::published_camera(rig.cameras[0]), *set[0].pixels},
      {config::published_camera(rig.cameras[1]), *set[1].pixels}};
  const config::Viewer viewer = test_viewer();
  const hull::DepthTile hull =
      hull::CpuHull(pool, silhouettes).depth({eye, viewer.near_m, viewer.far_m}, {0, 0, 160, 120});
  const hull::ObjectPixels& coloured = set[2].colour->pixels;
  int shown = 0;
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 160; ++u) {
      if (hull.depth_m[std::size_t(v * 160 + u)] == hull::kNoHull) continue;
      ++shown;
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du)
          if (u + du >= 0 && v + dv >= 0 && u + du < 160 && v + dv < 120) {
            ASSERT_TRUE(coloured.contains(u + du, v + dv)) << u << ' ' << v;
          }
    }
  EXPECT_GT(shown, 500);
  const VisibleRegion visible =
      visible_region(viewer, config::eye_from_world_at(viewer, 10 / 30.0));
  EXPECT_EQ(coloured, footprint({{silhouettes[0].camera, set[0].pixels->bounds()},
                                 {silhouettes[1].camera, set[1].pixels->bounds()},
                                 visible.part},
                                visible.box_m, eye, 2));
  for (const hull::Silhouette& one : silhouettes)
    EXPECT_LT(coloured.count(),
              footprint({visible.part, {one.camera, one.pixels.bounds()}}, visible.box_m, eye, 2)
                  .count());
  for (const CapturedCamera& camera : capture.capture(11, false)) EXPECT_FALSE(camera.colour);
  EXPECT_FALSE(capture.ended());
}

// The viewer looks away, the spectator at the object; also if the frames are precomputed.
TEST(Capture, ACameraWithoutShapeSendsWhatSpectatorsSee) {
  config::Rig rig = table_rig();
  rig.cameras[2] = test::table_camera("above", {0, -0.3, 2}, 160, 120);
  rig.cameras[2].gives_shape = false;
  config::Viewer away = test_viewer();
  away.path = {{0, {0, -0.8, 0.8}, {0, -3, 0.8}}};
  config::Viewer spectator = test_viewer();
  spectator.name = "audience";
  for (const int precomputed : {0, 2}) {
    config::CaptureConfig config = synthetic_config(rig);
    config.precomputed_frames = precomputed;
    Capture alone(rig, away, config, 30), watched(rig, away, config, 30, {}, {spectator}),
        seen(rig, spectator, config, 30);
    EXPECT_FALSE(alone.capture(1, true)[2].colour);
    const auto colour = watched.capture(1, true)[2].colour;
    ASSERT_TRUE(colour);
    EXPECT_EQ(colour->pixels, seen.capture(1, true)[2].colour.value().pixels);
  }
}

// A camera without shape sends what at least one eye can see.
TEST(Capture, TheColourSufficesForBothEyesOfAStereoViewer) {
  const config::Rig rig = table_rig();
  config::Viewer viewer = test_viewer();
  viewer.eye_distance_m = 0.3;
  viewer.horizontal_fov_rad = 0.3;  // neither eye sees the whole hand
  const Eigen::Isometry3d head = config::eye_from_world_at(viewer, 10 / 30.0);
  Capture capture(rig, viewer, synthetic_config(rig), 30);
  const std::vector<CapturedCamera> set = capture.capture(10, true);
  ASSERT_TRUE(set.at(2).colour);
  const geometry::Camera camera = config::published_camera(rig.cameras[2], head);
  EXPECT_TRUE(set[2].colour->camera.camera_from_world.isApprox(camera.camera_from_world))
      << "the camera is on the head, not on an eye";
  hull::ObjectPixels expected(160, 120);
  std::vector<std::size_t> counts;
  for (const double x_m : {-0.15, 0.15}) {
    const VisibleRegion eye = visible_region(viewer, Eigen::Translation3d(-x_m, 0, 0) * head);
    const hull::ObjectPixels pixels =
        footprint({{config::published_camera(rig.cameras[0]), set[0].pixels->bounds()},
                   {config::published_camera(rig.cameras[1]), set[1].pixels->bounds()},
                   eye.part},
                  eye.box_m, camera, 2);
    counts.push_back(pixels.count());
    for (int v = 0; v < 120; ++v)
      for (int u = 0; u < 160; ++u)
        if (pixels.contains(u, v)) expected.set(u, v);
  }
  EXPECT_EQ(set[2].colour->pixels, expected);
  EXPECT_GT(expected.count(), std::max(counts[0], counts[1])) << "the eyes see different parts";
}

// Compares the shortest of 12 readings, because other processes lengthen some.
TEST(Capture, ReadsPrerenderedImagesInLessThanHalfTheTimeOfRendering) {
  const config::Rig rig = table_rig();
  config::CaptureConfig config = synthetic_config(rig);
  config.synthetic.noise_sigma_levels = 0;
  config.synthetic.period_s = 0.2;  // six frames
  const auto read_s = [&](bool prerender) {
    config.synthetic.prerender = prerender;
    Capture capture(rig, test_viewer(), config, 30);
    std::array<double, 2> shortest = {1, 1};
    for (int frame = 0; frame < 12; ++frame) {
      const auto set = capture.capture(frame, false);
      for (std::size_t i = 0; i < 2; ++i) shortest[i] = std::min(shortest[i], set[i].read_s);
    }
    return shortest;
  };
  const auto prerendered = read_s(true), rendered = read_s(false);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LT(prerendered[i], rendered[i] / 2) << i;
}

// Capture learns each background from 24 images of the empty room, and stops OpenCV's own
// threads.
TEST(Capture, SyntheticCamerasLearnFrom24ImagesOfTheEmptyRoom) {
  const config::Rig rig = table_rig();
  config::CaptureConfig config = synthetic_config(rig);
  config.synthetic.noise_sigma_levels = 7;
  config.segmentation.threshold_sigmas = 3;  // so that the maps contain noise and differ
  config.segmentation.opening_px = 0;
  Capture capture(rig, test_viewer(), config, 30);
  EXPECT_EQ(cv::getNumThreads(), 1);
  const auto set = capture.capture(44, true);
  for (std::size_t i = 0; i < 2; ++i) {
    test::TestCamera camera(rig.cameras[i], config.synthetic, config.segmentation, 24);
    EXPECT_EQ(set[i].pixels.value(), camera.segment(44));
  }
  for (const CapturedCamera& camera : set) {
    EXPECT_GT(camera.read_s, 0);
    EXPECT_GT(camera.segment_s, 0);
  }
}

TEST(Capture, ErrorsOfTheCallersProgressArePassedOn) {
  const config::Rig rig = table_rig();
  config::CaptureConfig config = synthetic_config(rig);
  EXPECT_THROW(Capture(rig, test_viewer(), config, 30,
                       [](std::string_view, double) { throw std::out_of_range("progress"); }),
               std::out_of_range);
}

TEST(Capture, ReportsItsProgress) {
  config::Rig rig = table_rig();
  rig.cameras.pop_back();
  config::CaptureConfig config = synthetic_config(rig);
  config.precomputed_frames = 4;
  std::vector<std::pair<std::string, double>> steps;
  Capture capture(rig, test_viewer(), config, 30, [&](std::string_view what, double fraction) {
    steps.emplace_back(what, fraction);
  });
  ASSERT_EQ(steps.size(), 6u);
  std::set<std::string> cameras;
  for (std::size_t i = 0; i < 2; ++i) {
    cameras.insert(steps[i].first);
    EXPECT_EQ(steps[i].second, 0.5 * double(i + 1));
  }
  EXPECT_EQ(cameras, (std::set<std::string>{"camera cam0: source and background",
                                            "camera cam1: source and background"}));
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(steps[i + 2], std::pair(std::string("precomputing frames"), 0.25 * double(i + 1)));
}

TEST(Capture, ResultIsIndependentOfEarlierCaptures) {
  const config::Rig rig = table_rig();
  Capture a(rig, test_viewer(), synthetic_config(rig), 30),
      b(rig, test_viewer(), synthetic_config(rig), 30);
  b.capture(3, true);
  b.capture(90, false);
  const auto one = a.capture(44, true), two = b.capture(44, true);
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].pixels, two[i].pixels);
    EXPECT_EQ(one[i].colour->bgr, two[i].colour->bgr);
  }
}

TEST(Capture, LoopsPrecomputedFrames) {
  const config::Rig rig = table_rig();
  config::CaptureConfig config = synthetic_config(rig);
  Capture live(rig, test_viewer(), config, 30);
  config.precomputed_frames = 4;
  Capture precomputed(rig, test_viewer(), config, 30);
  for (const std::int64_t frame : {0, 3, 5, 4003}) {
    const auto expected = live.capture(frame % 4, true), found = precomputed.capture(frame, true);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(expected[i].pixels, found[i].pixels);
      EXPECT_EQ(expected[i].colour->bgr, found[i].colour->bgr);
    }
  }
  EXPECT_FALSE(precomputed.capture(0, false)[0].colour);
}

TEST(Capture, DiagnosesACameraWithoutObjectPixels) {
  config::Rig rig = table_rig();
  rig.cameras[1].camera_from_mount =
      geometry::look_at({1.5, 0.9, 1.3}, {3, 3, 1});  // away from the table
  Capture capture(rig, test_viewer(), synthetic_config(rig), 30);
  const auto set = capture.capture(0, true);
  EXPECT_TRUE(set[0].diagnostics.empty());
  ASSERT_EQ(set[1].diagnostics.size(), 1u);
  EXPECT_EQ(set[1].pixels->count(), 0u);
  for (const CapturedCamera& camera : set) EXPECT_FALSE(camera.colour) << "the hull is empty";
}

// Limits::seen: such a camera empties the hull only where it sees.
TEST(Capture, SendsColoursWhileEnoughCamerasHaveObjectPixels) {
  config::Rig rig = table_rig();
  rig.cameras[1].camera_from_mount =
      geometry::look_at({1.5, 0.9, 1.3}, {3, 3, 1});  // away from the table
  config::CaptureConfig config = synthetic_config(rig);
  const int others = int(config::shape_cameras(rig).size()) - 1;
  for (const int min_seen : {1, others, others + 1}) {
    config.hull_rule = {hull::Limits::seen, min_seen};
    Capture capture(rig, test_viewer(), config, 30);
    const auto set = capture.capture(0, true);
    EXPECT_EQ(set[0].colour.has_value(), min_seen <= others);
    EXPECT_FALSE(set[1].colour);
    EXPECT_TRUE(set[1].diagnostics.empty()) << "the usual state of such a camera";
  }
  // Another node reads the other cameras.
  config.hull_rule = {hull::Limits::seen, 2};
  const auto source = config.sources.extract("cam0");
  config.sources.clear();
  config.sources.insert({source.key(), source.mapped()});
  Capture capture(rig, test_viewer(), config, 30);
  EXPECT_TRUE(capture.capture(0, true).at(0).colour);
}

// The corners of the published image are beyond the lens.
TEST(Capture, TheLensMustShowTheWholeImageThatLimitsTheHullWhereItSees) {
  config::Rig rig = table_rig();
  rig.cameras[0].distortion.k1 = -0.2;
  rig.cameras[0].published =
      geometry::whole_pinhole(rig.cameras[0].source, rig.cameras[0].distortion);
  config::CaptureConfig config = synthetic_config(rig);
  EXPECT_NO_THROW(Capture(rig, test_viewer(), config, 30));
  config.hull_rule.limits = hull::Limits::seen;
  try {
    Capture(rig, test_viewer(), config, 30);
    ADD_FAILURE() << "no SourceError";
  } catch (const SourceError& error) {
    ASSERT_EQ(error.problems().size(), 1u);
    EXPECT_EQ(error.problems()[0].camera, "cam0");
    EXPECT_NE(std::string(error.what()).find("its lens must show the whole published image"),
              std::string::npos);
  }
  rig.cameras[0].published = rig.cameras[0].source;  // barrel distortion shows more
  EXPECT_NO_THROW(Capture(rig, test_viewer(), config, 30));
}

TEST(Capture, ErrorListsEveryUnavailableCamera) {
  const config::Rig rig = table_rig();
  config::CaptureConfig config = synthetic_config(rig);
  config.sources["cam0"] =
      config::VideoSource{"/nowhere/a.avi", config::LearnedBackground{"/nowhere/b.avi"}, 0};
  config.sources["cam1"] = config::V4l2Source{"/dev/v4l/by-id/none", {}};
  try {
    Capture capture(rig, test_viewer(), config, 30);
    FAIL() << "no error";
  } catch (const HardwareMissing& error) {
    ASSERT_EQ(error.problems().size(), 2u);
    const std::string what = error.what();
    EXPECT_NE(what.find("cam0: /nowhere/a.avi"), std::string::npos) << what;
    EXPECT_NE(what.find("cam1: /dev/v4l/by-id/none"), std::string::npos) << what;
  }
  config.sources.erase("cam1");
  EXPECT_THROW(
      try { Capture(rig, test_viewer(), config, 30); } catch (const HardwareMissing&) {
        FAIL() << "no source is a device";
      },
      SourceError);
}

// The footprint covers everything that the viewer sees, in the hull's box.
TEST(Footprint, OfTheVisibleRegionIsTheWholeImageOfTheEye) {
  const config::Viewer viewer = test_viewer();
  const Eigen::Isometry3d eye_from_world = config::eye_from_world_at(viewer, 0.5);
  const VisibleRegion seen = visible_region(viewer, eye_from_world);
  const geometry::Camera narrower{geometry::pinhole_from_fov(200, 150, 0.5), eye_from_world};
  EXPECT_EQ(footprint({seen.part}, seen.box_m, narrower, 2).count(), 200u * 150u);
  for (const double u : {0.0, 319.0})
    for (const double v : {0.0, 239.0}) {
      const geometry::Ray ray = geometry::ray_through(seen.part.camera, {u, v});
      EXPECT_TRUE(seen.box_m.contains(ray.origin_world_m + viewer.far_m * ray.direction_world));
    }
  const Eigen::AlignedBox3d volume(Eigen::Vector3d(-0.1, -0.2, 0), Eigen::Vector3d(0.3, 0.2, 0.1));
  EXPECT_TRUE(visible_region(viewer, eye_from_world, volume).box_m.isApprox(volume));
}

TEST(Footprint, OfABoxIsItsProjection) {
  const geometry::Camera camera{geometry::pinhole_from_fov(200, 100, 1.0),
                                geometry::look_at({0, -2, 0}, {0, 0, 0})};
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.1, -0.1, -0.1), Eigen::Vector3d(0.1, 0.1, 0.1));
  const hull::PixelRect rect = footprint({}, box, camera, 0).bounds();
  const double half_px = camera.pinhole.fx_px * 0.1 / 1.9;
  EXPECT_NEAR(rect.width_px(), 2 * half_px, 2);
  EXPECT_NEAR(0.5 * (rect.u0_px + rect.u1_px), 100, 1);
  EXPECT_EQ(footprint({}, box, camera, 3).bounds().width_px(), rect.width_px() + 6);
  EXPECT_EQ(
      footprint({}, {Eigen::Vector3d(-1, -3, -1), Eigen::Vector3d(1, 3, 1)}, camera, 0).count(),
      200u * 100u)
      << "the box contains the camera";
  EXPECT_EQ(
      footprint({}, {Eigen::Vector3d(50, 0, 0), Eigen::Vector3d(51, 1, 1)}, camera, 0).count(), 0u);
  EXPECT_EQ(
      footprint({}, {Eigen::Vector3d(-1, -5, -1), Eigen::Vector3d(1, -3, 1)}, camera, 0).count(),
      0u)
      << "the box is behind the camera";
}

// Compares each pixel's square with the polygon of the box's projected corners, by separating axes.
TEST(Footprint, HasThePixelsThatTouchTheProjectedBox) {
  constexpr double kWidening_px = 0.02;  // of corners_around_hull(), and rounding to float
  std::mt19937 random(4);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * double(random()) / 4294967295.0;
  };
  int compared = 0, set = 0, uncertain = 0;
  for (int i = 0; i < 20; ++i) {
    const int margin_px = i % 3;
    // The boxes with a margin are inside the image, because the image also limits the corners.
    const geometry::Camera camera{
        geometry::pinhole_from_fov(90, 70, 1.0),
        geometry::look_at({uniform(-1, 1), -2, uniform(-1, 1)}, {0, 0, 0})};
    const double reach_m = margin_px > 0 ? 0.3 : 1.1;
    const Eigen::Vector3d center{uniform(-reach_m, reach_m), uniform(-0.2, 0.2),
                                 uniform(-reach_m, reach_m)},
        half{uniform(0.01, 0.3), uniform(0.01, 0.3), uniform(0.01, 0.3)};
    const Eigen::AlignedBox3d box(center - half, center + half);
    std::vector<Eigen::Vector2d> corners;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector2d uv =
          geometry::project(camera, box.corner(Eigen::AlignedBox3d::CornerType(corner))).value();
      for (const int du : {-margin_px, margin_px})
        for (const int dv : {-margin_px, margin_px})
          corners.push_back(uv + Eigen::Vector2d(du, dv));
    }
    // Outward normals and largest products of the axes that can separate a pixel's square from the
    // polygon. An edge of the polygon is a line through two corners that has all others on one
    // side.
    std::vector<std::pair<Eigen::Vector2d, double>> supports;
    const auto add = [&](const Eigen::Vector2d& normal, double at_least) {
      double largest = -INFINITY;
      for (const Eigen::Vector2d& corner : corners) largest = std::max(largest, normal.dot(corner));
      if (at_least > largest - 1e-6) supports.emplace_back(normal, largest);
    };
    for (const Eigen::Vector2d& axis : {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)})
      for (const double sign : {-1, 1}) add(sign * axis, INFINITY);
    for (const Eigen::Vector2d& a : corners)
      for (const Eigen::Vector2d& b : corners)
        if ((b - a).norm() > 1e-6) {
          const Eigen::Vector2d normal = Eigen::Vector2d(b.y() - a.y(), a.x() - b.x()).normalized();
          add(normal, normal.dot(a));
        }
    const hull::ObjectPixels found = footprint({}, box, camera, margin_px);
    for (int v = 0; v < 70; ++v)
      for (int u = 0; u < 90; ++u) {
        double gap_px = -INFINITY;
        for (const auto& [normal, largest] : supports)
          gap_px = std::max(
              gap_px, normal.dot(Eigen::Vector2d(u, v)) - 0.5 * normal.cwiseAbs().sum() - largest);
        if (std::abs(gap_px) < kWidening_px) {
          ++uncertain;
          continue;
        }
        ASSERT_EQ(found.contains(u, v), gap_px < 0) << i << ": " << u << ' ' << v << ' ' << gap_px;
        ++compared;
        set += gap_px < 0;
      }
  }
  EXPECT_GT(set, 4000);
  EXPECT_LT(uncertain, compared / 100);
}

TEST(Footprint, BeginsAtADepthOfACentimetre) {
  const geometry::Camera camera{geometry::pinhole_from_fov(200, 100, 1.0),
                                Eigen::Isometry3d::Identity()};
  const auto count = [&](double from_m, double to_m) {
    return footprint({},
                     {Eigen::Vector3d(-0.001, -0.001, from_m), Eigen::Vector3d(0.001, 0.001, to_m)},
                     camera, 0)
        .count();
  };
  EXPECT_EQ(count(0.001, 0.0099), 0u);
  EXPECT_GT(count(0.001, 0.0101), 0u);
}

TEST(Footprint, TheVisibleRegionReachesTheFarPlaneInTheCorners) {
  config::Viewer viewer = test_viewer();
  viewer.far_m = 3;
  const Eigen::Isometry3d eye_from_world = config::eye_from_world_at(viewer, 0.5);
  const VisibleRegion seen = visible_region(viewer, eye_from_world);
  const geometry::Pinhole& k = seen.part.camera.pinhole;
  EXPECT_EQ(seen.part.part, (hull::PixelRect{0, 0, k.width_px, k.height_px}));
  double farthest_m = 0;
  for (const double u : {0, k.width_px})
    for (const double v : {0, k.height_px})
      farthest_m =
          std::max(farthest_m,
                   3 * Eigen::Vector3d((u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, 1).norm());
  const Eigen::Vector3d eye_m = geometry::camera_center_world_m(seen.part.camera);
  EXPECT_TRUE(seen.box_m.min().isApprox(eye_m - Eigen::Vector3d::Constant(farthest_m), 1e-9));
  EXPECT_TRUE(seen.box_m.max().isApprox(eye_m + Eigen::Vector3d::Constant(farthest_m), 1e-9));
}

// Two other cameras see a forearm that extends from behind the camera. The footprint contains all
// pixels of the forearm and at most 3/5 of the image.
TEST(Footprint, ContainsEveryObjectPixel) {
  const std::vector<hull::Capsule> object = {{{0, -1.5, 0.3}, {0.05, 0, 0.1}, 0.05},
                                             {{0.05, 0, 0.1}, {0.15, 0.1, 0.12}, 0.02}};
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-2, -2, -1), Eigen::Vector3d(2, 2, 2));
  std::vector<hull::SilhouetteBounds> parts;
  for (const Eigen::Vector3d& eye_m :
       {Eigen::Vector3d(-2, 0.5, 1.5), Eigen::Vector3d(1.8, -0.7, 1.4)}) {
    const geometry::Camera camera{geometry::pinhole_from_fov(720, 486, 1.0),
                                  geometry::look_at(eye_m, {0, 0, 0.2})};
    parts.push_back(
        {camera, hull::true_object_pixels(object, camera, hull::PixelRule::touched).bounds()});
  }
  for (const double x_m : {-0.2, 0.0, 0.3}) {
    const geometry::Camera on_viewer{geometry::pinhole_from_fov(640, 480, 1.05),
                                     geometry::look_at({x_m, -0.8, 0.6}, {0, 0, 0.2})};
    const hull::ObjectPixels truth = hull::true_object_pixels(object, on_viewer,
                                                              hull::PixelRule::touched),
                             found = footprint(parts, box, on_viewer, 2);
    ASSERT_GT(truth.count(), 5000u);
    for (int v = 0; v < 480; ++v)
      for (int u = 0; u < 640; ++u)
        if (truth.contains(u, v)) {
          ASSERT_TRUE(found.contains(u, v)) << u << ' ' << v;
        }
    EXPECT_LT(found.count(), 640u * 480u * 3 / 5);
  }
}

}  // namespace
}  // namespace fivepipe::capture
