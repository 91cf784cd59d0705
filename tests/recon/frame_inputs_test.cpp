#include "recon_node/frame_inputs.h"

#include <gtest/gtest.h>

namespace fivepipe::recon {
namespace {

constexpr std::int64_t kPeriod_ns = 33'000'000;
constexpr std::uint64_t kWriter = 11;
std::int64_t stamp_ns(std::uint64_t frame) { return std::int64_t(frame) * kPeriod_ns; }

messages::FramePose pose_of(std::uint64_t frame) {
  return {frame, stamp_ns(frame), Eigen::Isometry3d::Identity(), {}};
}
messages::CameraColour colour_of(std::size_t camera, std::uint64_t frame, std::uint8_t blue = 0) {
  hull::ObjectPixels pixels(4, 4);
  pixels.set(1, 1);
  return {camera, frame, stamp_ns(frame), {{}, pixels, {1, 1, 2, 2}, {blue, 0, 0}}};
}

TEST(FrameInputs, ReturnsThePoseAndTheColoursOfTheFrameByCamera) {
  FrameInputs inputs;
  inputs.add(pose_of(7), kWriter);
  EXPECT_EQ(inputs.add(colour_of(2, 7, 20), kWriter), nullptr);
  EXPECT_EQ(inputs.add(colour_of(0, 7, 10), kWriter), nullptr);
  EXPECT_EQ(inputs.add(colour_of(0, 8, 30), kWriter), nullptr);
  ASSERT_TRUE(inputs.pose_of(7));
  EXPECT_EQ(inputs.pose_of(7)->capture_stamp_ns, stamp_ns(7));
  EXPECT_EQ(inputs.pose_of(8), nullptr);
  const auto colours = inputs.take_colours(7);
  ASSERT_EQ(colours.size(), 2u);
  EXPECT_EQ(colours[0].bgr[0], 10);
  EXPECT_EQ(colours[1].bgr[0], 20);
  EXPECT_TRUE(inputs.take_colours(7).empty());
  inputs.drop_colours_up_to(8);
  EXPECT_TRUE(inputs.take_colours(8).empty());
}

// A writer that repeats a camera's colour must not grow the memory of a frame.
TEST(FrameInputs, KeepsOneColourPerCameraAndFrame) {
  FrameInputs inputs;
  EXPECT_EQ(inputs.add(colour_of(0, 5, 0), kWriter), nullptr);
  for (int i = 1; i <= 1000; ++i)
    EXPECT_STREQ(inputs.add(colour_of(0, 5, std::uint8_t(i % 200)), kWriter), "repeated_colour");
  const auto colours = inputs.take_colours(5);
  ASSERT_EQ(colours.size(), 1u);
  EXPECT_EQ(colours[0].bgr[0], 1000 % 200);
}

TEST(FrameInputs, KeepsTheFramesThatWereAddedLast) {
  constexpr std::uint64_t kFrames = 16;
  FrameInputs inputs;
  for (std::uint64_t frame = 0; frame <= kFrames; ++frame) {
    inputs.add(pose_of(frame), kWriter);
    inputs.add(colour_of(0, frame), kWriter);
  }
  EXPECT_FALSE(inputs.pose_of(0));
  EXPECT_TRUE(inputs.take_colours(0).empty());
  for (std::uint64_t frame = 1; frame <= kFrames; ++frame) {
    EXPECT_TRUE(inputs.pose_of(frame)) << frame;
    EXPECT_EQ(inputs.take_colours(frame).size(), 1u) << frame;
  }
}

// Frame numbers near 2^64 must not displace the true frames: a table of the largest numbers would
// keep them for ever.
TEST(FrameInputs, WrongFrameNumbersDoNotKeepFramesOut) {
  FrameInputs inputs;
  std::uint64_t wrong = UINT64_MAX - 10'000;
  for (std::uint64_t frame = 0; frame < 200; ++frame) {
    for (std::size_t i = 0; i <= FrameInputs::kMaxFrames; ++i) {
      messages::FramePose pose = pose_of(frame);
      messages::CameraColour colour = colour_of(1, frame);
      pose.frame = colour.frame = ++wrong;
      inputs.add(pose, kWriter);
      inputs.add(std::move(colour), kWriter);
    }
    inputs.add(pose_of(frame), kWriter);
    EXPECT_EQ(inputs.add(colour_of(0, frame), kWriter), nullptr);
    ASSERT_TRUE(inputs.pose_of(frame)) << frame;
    ASSERT_EQ(inputs.take_colours(frame).size(), 1u) << frame;
  }
}

// If reset() kept the newest frame, the first messages of a replay, which have lower numbers and
// earlier timestamps, would count as late.
TEST(FrameInputs, ResetForgetsPosesColoursAndTheNewestFrame) {
  FrameInputs inputs;
  inputs.add(pose_of(1000), kWriter);
  inputs.add(colour_of(0, 1000), kWriter);
  inputs.reset();
  EXPECT_EQ(inputs.pose_of(1000), nullptr);
  EXPECT_TRUE(inputs.take_colours(1000).empty());
  inputs.add(colour_of(0, 1), kWriter);
  for (std::uint64_t frame = 1; frame <= 20; ++frame) inputs.add(pose_of(frame), kWriter);
  EXPECT_EQ(inputs.take_colours(1).size(), 1u);
}

TEST(FrameInputs, ForgetsFramesOfAnEarlierRun) {
  FrameInputs inputs;
  inputs.add(pose_of(100), kWriter);
  inputs.add(colour_of(0, 100), kWriter);
  inputs.add(pose_of(50), kWriter);
  EXPECT_TRUE(inputs.pose_of(100)) << "a late pose";
  inputs.add(pose_of(0), kWriter + 1);
  EXPECT_EQ(inputs.pose_of(100), nullptr);
  EXPECT_TRUE(inputs.take_colours(100).empty());
  EXPECT_TRUE(inputs.pose_of(0));
}

// The colour of a frame with the same number from before a restart belongs to another image. The
// new process counts from the first message of any camera on.
TEST(FrameInputs, ForgetsColoursOfTheProcessBeforeARestart) {
  FrameInputs inputs;
  for (const std::size_t camera : {0, 1}) inputs.add(colour_of(camera, 3, 10), kWriter);
  EXPECT_EQ(inputs.add(colour_of(0, 3, 20), kWriter + 1), nullptr);
  EXPECT_STREQ(inputs.add(colour_of(1, 3, 11), kWriter), "other_writer");
  const auto colours = inputs.take_colours(3);
  ASSERT_EQ(colours.size(), 1u);
  EXPECT_EQ(colours[0].bgr[0], 20);
}

// Cameras differ in speed and delay.
TEST(FrameInputs, TheColoursOfAFrameMayBeOfDifferentTimes) {
  FrameInputs inputs;
  for (const std::int64_t stamp_ns : {INT64_MIN, std::int64_t{0}, INT64_MAX}) {
    messages::CameraColour colour = colour_of(stamp_ns == 0 ? 0 : stamp_ns < 0 ? 1 : 2, 4);
    colour.capture_stamp_ns = stamp_ns;
    EXPECT_EQ(inputs.add(std::move(colour), kWriter), nullptr);
  }
  EXPECT_EQ(inputs.take_colours(4).size(), 3u);
}

}  // namespace
}  // namespace fivepipe::recon
