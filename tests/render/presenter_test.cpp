#include "render_node/output/presenter.h"
#include "tests/support/test_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

namespace fivepipe::render {
namespace {

namespace fs = std::filesystem;

const cv::Size kFrameSize(160, 120);

class PresenterTest : public testing::Test {
 protected:
  PresenterTest() {
    viewer_.render_width_px = kFrameSize.width;
    viewer_.render_height_px = kFrameSize.height;
  }

  // A grey image with a bright bar whose column encodes the number.
  static cv::Mat image(int number) {
    cv::Mat image(kFrameSize, CV_8UC3, cv::Scalar(90, 90, 90));
    image.colRange(8 * number, 8 * number + 8).setTo(cv::Scalar(230, 230, 230));
    return image;
  }
  static int number_of(const cv::Mat& image) {
    for (int number = 0; number < kFrameSize.width / 8; ++number)
      if (image.at<cv::Vec3b>(60, 8 * number + 4)[1] > 160) return number;
    return -1;
  }
  static std::vector<int> numbers_in(const fs::path& video) {
    cv::VideoCapture capture(video.string(), cv::CAP_FFMPEG);
    std::vector<int> numbers;
    for (cv::Mat frame; capture.read(frame);) numbers.push_back(number_of(frame));
    return numbers;
  }
  static std::vector<int> repeated(int number, std::size_t times) {
    return std::vector<int>(times, number);
  }
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) names.insert(entry.path().filename());
    return names;
  }

  const test::TestFolder test_folder_;
  const fs::path folder_ = test_folder_.path;
  config::Viewer viewer_;
};

TEST_F(PresenterTest, WritesNothingWithoutAFolder) {
  Presenter presenter({}, viewer_, 30, "");
  EXPECT_FALSE(presenter.needs_still());
  EXPECT_FALSE(presenter.wants(0));
  EXPECT_TRUE(presenter.present(0, image(1)));
  presenter.finish();
  EXPECT_EQ(presenter.video_frames_dropped(), 0u);
  EXPECT_TRUE(files().empty());
}

TEST_F(PresenterTest, TheStillIsTheFirstFrameAtOrAfterTheConfiguredOne) {
  const fs::path out = folder_ / "new" / "folder";
  Presenter presenter({.video = false, .still_frame = 10}, viewer_, 30, out);
  EXPECT_FALSE(presenter.wants(9));
  EXPECT_TRUE(presenter.wants(10));
  EXPECT_TRUE(presenter.present(9, image(9)));
  EXPECT_FALSE(fs::exists(out / "composite.png"));
  EXPECT_TRUE(presenter.needs_still());
  EXPECT_TRUE(presenter.wants(12));
  EXPECT_TRUE(presenter.present(12, image(12)));
  EXPECT_FALSE(presenter.needs_still());
  EXPECT_FALSE(presenter.wants(13));
  EXPECT_TRUE(presenter.present(13, image(13)));
  presenter.finish();
  EXPECT_EQ(cv::norm(cv::imread((out / "composite.png").string()), image(12), cv::NORM_INF), 0);
  EXPECT_EQ(std::distance(fs::directory_iterator(out), fs::directory_iterator()), 1);
}

TEST_F(PresenterTest, TheFilesOfASpectatorHaveItsName) {
  viewer_.name = "audience";
  config::RenderConfig config;
  config.viewer = viewer_;
  Presenter presenter(config, viewer_, 30, folder_);
  presenter.present(0, image(1));
  presenter.finish();
  EXPECT_EQ(files(), (std::set<std::string>{"composite_audience.mp4", "composite_audience.png"}));
}

TEST_F(PresenterTest, TheStillIsTheConfiguredFrame) {
  Presenter presenter({.video = false, .still_frame = 10}, viewer_, 30, folder_);
  for (const int frame : {9, 10, 11}) presenter.present(std::uint64_t(frame), image(frame));
  presenter.finish();
  EXPECT_EQ(number_of(cv::imread((folder_ / "composite.png").string())), 10);
}

// Another thread writes it, so its error is reported later.
TEST_F(PresenterTest, AStillThatCannotBeWrittenIsReported) {
  fs::create_directory(folder_ / "composite.png.part");
  Presenter presenter({.video = false}, viewer_, 30, folder_);
  EXPECT_TRUE(presenter.present(0, image(1)));
  EXPECT_THROW(presenter.finish(), OutputError);
}

TEST_F(PresenterTest, AWindowNeedsADisplay) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  EXPECT_THROW(Presenter({.window = true}, viewer_, 30, ""), WindowError);
}

TEST_F(PresenterTest, TheStillIsTheLastFrameIfTheConfiguredOneNeverComes) {
  Presenter presenter({.video = false, .still_frame = 10}, viewer_, 30, folder_);
  presenter.present(3, image(3));
  presenter.present(4, image(4));
  presenter.finish();
  EXPECT_EQ(number_of(cv::imread((folder_ / "composite.png").string())), 4);
}

TEST_F(PresenterTest, WithoutAFrameThereIsNoStill) {
  Presenter presenter({.video = false}, viewer_, 30, folder_);
  presenter.finish();
  EXPECT_TRUE(files().empty());
}

// The video keeps capture time: the previous image fills a gap of at most one second.
TEST_F(PresenterTest, TheVideoRepeatsTheImageBeforeAGap) {
  Presenter presenter({}, viewer_, 10, folder_);
  EXPECT_TRUE(presenter.wants(0));
  presenter.present(7, image(1));  // nothing before the first frame
  presenter.present(8, image(2));
  presenter.present(11, image(3));
  presenter.present(21, image(4));  // one second
  EXPECT_TRUE(presenter.wants(32));
  presenter.present(32, image(5));  // more than one second
  presenter.present(30, image(6));  // a restarted source counts again
  presenter.finish();
  EXPECT_EQ(presenter.video_frames_dropped(), 0u);
  std::vector<int> expected{1, 2, 2, 2, 3};
  for (const auto& part : {repeated(3, 9), {4, 5, 6}})
    expected.insert(expected.end(), part.begin(), part.end());
  EXPECT_EQ(numbers_in(folder_ / "composite.mp4"), expected);
  cv::VideoCapture video((folder_ / "composite.mp4").string(), cv::CAP_FFMPEG);
  EXPECT_NEAR(video.get(cv::CAP_PROP_FPS), 10, 0.01);
  EXPECT_EQ(files(), (std::set<std::string>{"composite.mp4", "composite.png"}));
}

// The gap of 0.9 s has more frames than wait for the encoder.
TEST_F(PresenterTest, CountsTheFramesThatTheEncoderDrops) {
  Presenter presenter({}, viewer_, 1000, folder_);
  presenter.present(0, image(1));
  presenter.present(900, image(2));
  const std::uint64_t dropped = presenter.video_frames_dropped();
  EXPECT_GT(dropped, 0u);
  presenter.finish();
  EXPECT_EQ(numbers_in(folder_ / "composite.mp4").size() + presenter.video_frames_dropped(), 901u);
}

TEST_F(PresenterTest, ARestartedProcessKeepsTheVideosOfItsPredecessors) {
  for (const int number : {1, 2, 3}) {
    Presenter presenter({}, viewer_, 30, folder_);
    presenter.present(0, image(number));
    presenter.finish();
  }
  EXPECT_EQ(files(), (std::set<std::string>{"composite.mp4", "composite-2.mp4", "composite-3.mp4",
                                            "composite.png"}));
  EXPECT_EQ(numbers_in(folder_ / "composite.mp4"), std::vector<int>{1});
  EXPECT_EQ(numbers_in(folder_ / "composite-2.mp4"), std::vector<int>{2});
  EXPECT_EQ(numbers_in(folder_ / "composite-3.mp4"), std::vector<int>{3});
}

}  // namespace
}  // namespace fivepipe::render
