#include "render_node/views/pending_frames.h"

#include <gtest/gtest.h>

#include <vector>

namespace fivepipe::render {
namespace {

using namespace std::chrono_literals;

constexpr PendingFrames::Clock::time_point kStart{};

EyeFrames frame(std::uint64_t number) {
  EyeFrames eyes(1);
  eyes[0].frame = number;
  eyes[0].capture_stamp_ns = std::int64_t(number) * 33'000'000;
  return eyes;
}

std::uint64_t number_of_first(const PendingFrames& pending) {
  return pending.first().front().frame;
}

TEST(PendingFrames, AFrameWaitsForTheTimeout) {
  PendingFrames pending;
  EXPECT_FALSE(pending.is_due(kStart, false)) << "there is none";
  pending.add(frame(5), kStart, FrameOrder::completion);
  EXPECT_EQ(number_of_first(pending), 5u);
  EXPECT_FALSE(pending.is_due(kStart + 39ms, false));
  EXPECT_TRUE(pending.is_due(kStart + 40ms, false));
  EXPECT_FALSE(pending.is_due(kStart + 1999ms, true));
  EXPECT_TRUE(pending.is_due(kStart + 2s, true));
}

TEST(PendingFrames, ANewerFrameEndsTheWaitButNotInALosslessReplay) {
  PendingFrames pending;
  pending.add(frame(5), kStart, FrameOrder::completion);
  EXPECT_FALSE(pending.is_superseded(false));
  pending.add(frame(6), kStart + 1ms, FrameOrder::completion);
  EXPECT_TRUE(pending.is_superseded(false));
  EXPECT_FALSE(pending.is_superseded(true));
  EXPECT_EQ(pending.take().front().frame, 5u);
  EXPECT_FALSE(pending.is_superseded(false));
  EXPECT_EQ(number_of_first(pending), 6u);
}

// Drawing frame 5 takes 50 ms, in which the node receives no state.
TEST(PendingFrames, TheTimeOfDrawingDoesNotCount) {
  PendingFrames pending;
  for (const std::uint64_t number : {5, 6})
    pending.add(frame(number), kStart, FrameOrder::completion);
  pending.take();
  pending.begin_wait(kStart + 50ms);
  EXPECT_FALSE(pending.is_due(kStart + 89ms, false));
  EXPECT_TRUE(pending.is_due(kStart + 90ms, false));
}

TEST(PendingFrames, AnOvertakenFrameIsFirstByItsCapture) {
  for (const FrameOrder order : {FrameOrder::completion, FrameOrder::capture}) {
    PendingFrames pending;
    for (const std::uint64_t number : {7, 5, 6}) pending.add(frame(number), kStart, order);
    std::vector<std::uint64_t> taken;
    while (!pending.empty()) taken.push_back(pending.take().front().frame);
    EXPECT_EQ(taken, order == FrameOrder::capture ? (std::vector<std::uint64_t>{5, 6, 7})
                                                  : (std::vector<std::uint64_t>{7, 5, 6}));
  }
}

// Its wait begins when it becomes the first.
TEST(PendingFrames, AnOvertakenFrameHasTheWholeTimeout) {
  PendingFrames pending;
  pending.add(frame(6), kStart, FrameOrder::capture);
  pending.add(frame(5), kStart + 1s, FrameOrder::capture);
  EXPECT_FALSE(pending.is_due(kStart + 2s, true));
  EXPECT_TRUE(pending.is_due(kStart + 3s, true));
}

TEST(PendingFrames, AFrameThatIsNotTheFirstDoesNotProlongItsWait) {
  PendingFrames pending;
  pending.add(frame(5), kStart, FrameOrder::capture);
  pending.add(frame(6), kStart + 1s, FrameOrder::capture);
  EXPECT_TRUE(pending.is_due(kStart + 2s, true));
}

// A live frame follows a lossless replay: the frames of the replay come before it, in their order.
TEST(PendingFrames, KeepTheirOrder) {
  PendingFrames pending;
  for (const std::uint64_t number : {5, 6, 7, 8})
    pending.add(frame(number), kStart, FrameOrder::completion);
  for (const std::uint64_t number : {5, 6, 7}) {
    ASSERT_TRUE(pending.is_superseded(false));
    EXPECT_EQ(pending.take().front().frame, number);
  }
  EXPECT_EQ(pending.size(), 1u);
  pending.clear();
  EXPECT_TRUE(pending.empty());
}

}  // namespace
}  // namespace fivepipe::render
