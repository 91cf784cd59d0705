#include "capture_node/pacing/frame_by_frame.h"

#include <gtest/gtest.h>

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;
const FrameByFrame::Clock::time_point kFirst{};

TEST(FrameByFrame, ReturnsEveryFrameOnceAndInOrder) {
  FrameByFrame frames(2, kFirst);
  EXPECT_EQ(frames.next(kFirst), 0);
  EXPECT_EQ(frames.next(kFirst), 1);
  EXPECT_EQ(frames.next(kFirst + 15s), std::nullopt) << "two are in flight";
  frames.composited(0, kFirst + 15s);
  EXPECT_EQ(frames.next(kFirst + 15s), 2) << "however long it took";
  EXPECT_EQ(frames.next(kFirst + 16s), std::nullopt);
  EXPECT_FALSE(frames.is_done(kFirst + 16s));
  frames.composited(1, kFirst + 17s);
  frames.composited(2, kFirst + 17s);
  EXPECT_TRUE(frames.is_done(kFirst + 17s));
  EXPECT_EQ(frames.take_lost(), 0u);
}

TEST(FrameByFrame, AWithdrawnFrameIsNotAwaited) {
  FrameByFrame frames(2, kFirst);
  EXPECT_EQ(frames.next(kFirst), 0);
  EXPECT_EQ(frames.next(kFirst), 1);
  frames.withdraw();
  frames.composited(0, kFirst);
  EXPECT_TRUE(frames.is_done(kFirst));
  EXPECT_EQ(frames.take_lost(), 0u);
}

TEST(FrameByFrame, AFrameThatIsPassedOverIsLost) {
  FrameByFrame frames(3, kFirst);
  for (int i = 0; i < 3; ++i) frames.next(kFirst);
  frames.composited(2, kFirst);
  EXPECT_EQ(frames.take_lost(), 2u);
  EXPECT_EQ(frames.take_lost(), 0u);
  frames.composited(1, kFirst);
  frames.composited(7, kFirst);
  EXPECT_EQ(frames.take_lost(), 0u) << "frames of another process, or late ones";
  EXPECT_TRUE(frames.is_done(kFirst));
}

TEST(FrameByFrame, FramesWithoutProgressAreLost) {
  FrameByFrame frames(1, kFirst);
  EXPECT_EQ(frames.next(kFirst + 100s), 0) << "the time before the first frame does not count";
  EXPECT_EQ(frames.next(kFirst + 119s), std::nullopt);
  EXPECT_EQ(frames.take_lost(), 0u);
  EXPECT_EQ(frames.next(kFirst + 120s), 1);
  EXPECT_EQ(frames.take_lost(), 1u);
  EXPECT_FALSE(frames.is_done(kFirst + 139s));
  EXPECT_TRUE(frames.is_done(kFirst + 140s));
  EXPECT_EQ(frames.take_lost(), 1u);
}

}  // namespace
}  // namespace fivepipe::capture
