// Files that begin again: videos, mattes, and a camera that only gives colour. The frame number
// alone decides which images a set has.
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "capture_node/capture.h"
#include "tests/support/capture/capture_rig.h"
#include "tests/support/test_folder.h"

namespace fivepipe::capture {
namespace {

constexpr int kWidth_px = 240, kHeight_px = 162, kStep_px = 40, kSquare_px = 30;

// Image n shows a square at kStep_px n.
cv::Mat image_of(int n, const cv::Scalar& room, const cv::Scalar& square) {
  cv::Mat image(kHeight_px, kWidth_px, CV_8UC3, room);
  image(cv::Rect(kStep_px * n, 50, kSquare_px, kSquare_px)).setTo(square);
  return image;
}

class FilesThatLoop : public testing::Test {
 protected:
  FilesThatLoop() {
    viewer_.path = {{0, {0, -0.8, 0.8}, {0, 0, 0.2}}};
    cv::imwrite(path("empty.png"), cv::Mat(kHeight_px, kWidth_px, CV_8UC3, kRoom));
  }
  std::string path(const std::string& name) const { return (folder_.path / name).string(); }
  std::string video(const std::string& name, int frames, const cv::Scalar& room = kRoom,
                    const cv::Scalar& square = {0, 0, 250}) const {
    cv::VideoWriter writer(path(name), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 30,
                           {kWidth_px, kHeight_px});
    for (int n = 0; n < frames; ++n) writer.write(image_of(n, room, square));
    return path(name);
  }
  void add_camera(const std::string& name, const std::string& file, const config::ObjectKey& key,
                  bool gives_shape = true) {
    rig_.cameras.push_back(test::table_camera(
        name, {-1.5 + 0.1 * double(rig_.cameras.size()), 0.9, 1.3}, kWidth_px, kHeight_px));
    rig_.cameras.back().gives_shape = gives_shape;
    config_.sources[name] = config::VideoSource{file, key, 0};
  }
  config::ObjectKey learned() const { return config::LearnedBackground{path("empty.png")}; }
  // Captures the frames in this order with a new Capture, and expects images n modulo `length`.
  void expect_length(int length, const std::vector<int>& frames) {
    Capture capture(rig_, viewer_, config_, 30);
    for (const int frame : frames)
      for (const CapturedCamera& camera : capture.capture(frame, false)) {
        if (camera.camera == "colour") continue;
        ASSERT_TRUE(camera.pixels) << camera.camera << " at " << frame << ": " << camera.reason;
        const hull::PixelRect bounds = camera.pixels->bounds();
        EXPECT_EQ((bounds.u0_px + bounds.u1_px) / 2 / kStep_px, frame % length)
            << camera.camera << " at " << frame;
      }
    EXPECT_FALSE(capture.ended());
  }

  static inline const cv::Scalar kRoom = cv::Scalar::all(60);
  config::Rig rig_;
  config::Viewer viewer_;
  config::CaptureConfig config_;
  const test::TestFolder folder_;
};

const std::vector<std::vector<int>> kOrders{{0, 1, 2, 3, 4}, {0, 2, 4}, {5},         {1001},
                                            {1001, 3},       {2, 7, 8}, {3, 3, 4, 1}};

TEST_F(FilesThatLoop, VideosBeginAgainAfterTheShortest) {
  add_camera("long", video("long.avi", 5), learned());
  add_camera("short", video("short.avi", 3), learned());
  for (const std::vector<int>& frames : kOrders) expect_length(3, frames);
}

TEST_F(FilesThatLoop, AMatteThatIsShorterThanItsVideoCounts) {
  add_camera("cam", video("video.avi", 4),
             config::MatteFile{video("matte.avi", 3, cv::Scalar::all(0), cv::Scalar::all(255))});
  for (const std::vector<int>& frames : kOrders) expect_length(3, frames);
}

// Also while the node does not read the colour.
TEST_F(FilesThatLoop, AShorterVideoOfACameraThatOnlyGivesColourCounts) {
  add_camera("cam", video("video.avi", 5), learned());
  add_camera("colour", video("colour.avi", 3), {}, false);
  for (const std::vector<int>& frames : {std::vector{5}, {1001}, {1001, 3}, {5, 6, 7, 8}})
    expect_length(3, frames);
}

// The images of a video have no numbers: its masks begin at 0 or 1.
TEST_F(FilesThatLoop, MasksOfAVideoBeginAt0Or1) {
  for (const int first : {0, 1, 2}) {
    const std::string name = "m" + std::to_string(first) + "_%d.png";
    for (int n = 0; n < 3; ++n)
      cv::imwrite(path("m" + std::to_string(first) + "_" + std::to_string(first + n) + ".png"),
                  image_of(n, cv::Scalar::all(0), cv::Scalar::all(255)));
    rig_.cameras.clear();
    add_camera("cam", video("video.avi", 3), config::MatteFile{path(name)});
    if (first < 2) {
      expect_length(3, {0, 1, 2, 3});
      continue;
    }
    try {
      Capture(rig_, viewer_, config_, 30);
      FAIL() << "no error";
    } catch (const SourceError& error) {
      EXPECT_EQ(std::string(error.what()),
                "cam: " + path(name) +
                    ": the masks of a video must begin at number 0 or 1, for its "
                    "first image; they begin at 2");
    }
  }
}

// All pixels of the mask are outside of the searched volume.
TEST_F(FilesThatLoop, AMaskOutsideOfTheVolumeIsNamed) {
  add_camera("cam", video("video.avi", 3),
             config::MatteFile{video("matte.avi", 3, cv::Scalar::all(0), cv::Scalar::all(255))});
  const auto diagnostics = [&](double x_m) {
    config_.segmentation.volume_m =
        Eigen::AlignedBox3d(Eigen::Vector3d(x_m - 5, -5, -5), Eigen::Vector3d(x_m + 5, 5, 5));
    return Capture(rig_, viewer_, config_, 30).capture(0, false).at(0).diagnostics;
  };
  EXPECT_TRUE(diagnostics(0).empty());
  const std::vector<std::string> found = diagnostics(-8);
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found[0].starts_with("all its object pixels are outside of `volume_m` or `regions`"))
      << found[0];
}

}  // namespace
}  // namespace fivepipe::capture
