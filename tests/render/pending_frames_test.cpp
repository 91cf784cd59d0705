#include "render_node/views/pending_frames.h"

#include <gtest/gtest.h>

namespace fivepipe::render {
namespace {

using namespace std::chrono_literals;

constexpr PendingFrames::Clock::time_point kStart{};

EyeFrames frame(std::uint64_t number) {
  EyeFrames eyes(1);
  eyes[0].frame = number;
  return eyes;
}

std::uint64_t number_of_first(const PendingFrames& pending) {
  return pending.first().front().frame;
}

TEST(PendingFrames, AFrameWaitsForTheTimeout) {
  PendingFrames pending;
  EXPECT_FALSE(pending.is_due(kStart, false)) << "there is none";
  pending.add(frame(5), kStart);
  EXPECT_EQ(number_of_first(pending), 5u);
  EXPECT_FALSE(pending.is_due(kStart + 39ms, false));
  EXPECT_TRUE(pending.is_due(kStart + 40ms, false));
  EXPECT_FALSE(pending.is_due(kStart + 1999ms, true));
  EXPECT_TRUE(pending.is_due(kStart + 2s, true));
}

TEST(PendingFrames, ANewerFrameEndsTheWaitButNotInALosslessReplay) {
  PendingFrames pending;
  pending.add(frame(5), kStart);
  EXPECT_FALSE(pending.is_superseded(false));
  pending.add(frame(6), kStart + 1ms);
  EXPECT_TRUE(pending.is_superseded(false));
  EXPECT_FALSE(pending.is_superseded(true));
  EXPECT_EQ(pending.take().front().frame, 5u);
  EXPECT_FALSE(pending.is_superseded(false));
  EXPECT_EQ(number_of_first(pending), 6u);
}

// Drawing frame 5 takes 50 ms, in which the node receives no state.
TEST(PendingFrames, TheTimeOfDrawingDoesNotCount) {
  PendingFrames pending;
  for (const std::uint64_t number : {5, 6}) pending.add(frame(number), kStart);
  pending.take();
  pending.begin_wait(kStart + 50ms);
  EXPECT_FALSE(pending.is_due(kStart + 89ms, false));
  EXPECT_TRUE(pending.is_due(kStart + 90ms, false));
}

TEST(PendingFrames, AFrameThatIsNotTheFirstDoesNotProlongItsWait) {
  PendingFrames pending;
  pending.add(frame(5), kStart);
  pending.add(frame(6), kStart + 1s);
  EXPECT_TRUE(pending.is_due(kStart + 2s, true));
}

// A live frame follows a lossless replay: the frames of the replay come before it, in their order.
TEST(PendingFrames, KeepTheirOrder) {
  PendingFrames pending;
  for (const std::uint64_t number : {5, 6, 7, 8}) pending.add(frame(number), kStart);
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
