// Pictures of frames, from videos whose picture k has the grey level 20 * k.
#include "launch/study/results/event_pictures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "common/pipeline/bus/topics.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/recording/synthetic_recordings.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::study {
namespace {

using CompositedTopic = bus::topics::FrameComposited;
constexpr double kRate_hz = 10;
constexpr double kLevels = 20;  // from one picture to the next

std::vector<std::byte> composited(std::uint64_t frame) {
  std::vector<std::byte> cdr = test::cdr_header();
  test::append_value(cdr, std::uint32_t(2));
  test::append_value(cdr, 'v');
  for (int i = 0; i < 3; ++i) test::append_value(cdr, '\0');  // end, padding
  test::append_value(cdr, frame);
  test::append_value(cdr, test::kStart_ns);
  test::append_value(cdr, test::kStart_ns);
  return cdr;
}

class EventPicturesTest : public testing::Test {
 protected:
  // A recording in which these frames were composited.
  recording::Recording recorded(const std::vector<std::uint64_t>& frames) {
    const std::filesystem::path file = folder_.path / "recording.mcap";
    {
      recording::RecordingWriter writer(file, "tests", {.sync = false});
      const mcap::Id channel =
          writer.add_channel(CompositedTopic::name, CompositedTopic::type,
                             schema::fivepipe_schema(CompositedTopic::type), {{"writer", "w"}});
      std::int64_t at_ns = test::kStart_ns;
      const auto add = [&](const std::vector<std::byte>& cdr) {
        ++at_ns;
        writer.add(channel, at_ns, at_ns, cdr);
      };
      for (const std::uint64_t frame : frames) add(composited(frame));
      std::vector<std::byte> cut = composited(7);
      cut.resize(10);
      add(cut);
    }
    return recording::Recording(file);
  }
  std::filesystem::path video(int pictures, int width_px = 640) {
    const std::filesystem::path file = folder_.path / "composite.avi";
    // Each picture by itself, so that its grey level is nearly exact.
    cv::VideoWriter writer(file, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), kRate_hz,
                           {width_px, width_px / 2});
    EXPECT_TRUE(writer.isOpened());
    for (int k = 0; k < pictures; ++k)
      writer.write(cv::Mat(width_px / 2, width_px, CV_8UC3, cv::Scalar::all(kLevels * (k % 12))));
    return file;
  }
  static cv::Mat decoded(const std::string& png) {
    return cv::imdecode(std::vector<std::uint8_t>(png.begin(), png.end()), cv::IMREAD_COLOR);
  }
  // The position in the video of a picture; -1: there is none.
  static int shown(const EventPictures& pictures, std::uint64_t frame) {
    const std::string png = pictures.png_of(frame);
    return png.empty() ? -1 : int(std::lround(cv::mean(decoded(png))[0] / kLevels));
  }
  test::TestFolder folder_;
};

TEST_F(EventPicturesTest, AreThoseOfTheirFrames) {
  const recording::Recording recording = recorded({100, 101, 102, 103, 104});
  const EventPictures pictures(recording, video(5));
  EXPECT_EQ(pictures.why_none(), "");
  // Also backwards: each is searched in the video.
  for (const int k : {4, 0, 2, 3, 1}) EXPECT_EQ(shown(pictures, 100 + std::uint64_t(k)), k);
  EXPECT_EQ(shown(pictures, 99), -1) << "before the first one";
}

TEST_F(EventPicturesTest, FollowTheRepeatedPicturesOfShortGaps) {
  // render_node writes one picture for each frame of a gap up to a second, none for a longer one.
  const recording::Recording recording = recorded({100, 103, 120});
  const EventPictures pictures(recording, video(5));
  EXPECT_EQ(shown(pictures, 100), 0);
  EXPECT_EQ(shown(pictures, 103), 3);
  EXPECT_EQ(shown(pictures, 120), 4);
  EXPECT_EQ(shown(pictures, 102), 0) << "the frame before it";
  EXPECT_EQ(shown(pictures, 113), 3) << "a second older";
  EXPECT_EQ(shown(pictures, 114), -1) << "more than a second older";
}

TEST_F(EventPicturesTest, AreAtMost320PixelsWide) {
  const recording::Recording recording = recorded({1});
  const cv::Mat large = decoded(EventPictures(recording, video(1)).png_of(1));
  EXPECT_EQ(large.size(), cv::Size(320, 160));
  const cv::Mat small = decoded(EventPictures(recording, video(1, 160)).png_of(1));
  EXPECT_EQ(small.size(), cv::Size(160, 80));
}

TEST_F(EventPicturesTest, StateWhyThereAreNone) {
  const EventPictures no_video(recorded({1}), folder_.path / "absent.mp4");
  EXPECT_TRUE(test::contains(no_video.why_none(), "absent.mp4 cannot be read"));
  EXPECT_EQ(no_video.png_of(1), "");
  const EventPictures no_frames(recorded({}), video(1));
  EXPECT_EQ(no_frames.why_none(), "the recording states no composited frames");
  EXPECT_EQ(no_frames.png_of(1), "");
  const EventPictures too_short(recorded({1, 2, 3}), video(1));
  EXPECT_EQ(too_short.png_of(3), "") << "the video ends before";
}

}  // namespace
}  // namespace fivepipe::study
