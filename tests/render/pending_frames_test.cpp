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

// Takes the frames that are due. Returns their numbers.
std::vector<std::uint64_t> taken(PendingFrames& pending, PendingFrames::Clock::time_point now,
                                 bool lossless) {
  std::vector<std::uint64_t> numbers;
  while (pending.is_due(now, lossless)) numbers.push_back(pending.take(now).front().frame);
  return numbers;
}

using Numbers = std::vector<std::uint64_t>;

TEST(PendingFrames, AFrameWaitsUntilItsTimeIsOver) {
  PendingFrames pending;
  EXPECT_FALSE(pending.is_due(kStart, false)) << "there is none";
  pending.add(frame(5), kStart);
  EXPECT_EQ(pending.first().front().frame, 5u);
  EXPECT_FALSE(pending.is_due(kStart + 39ms, false));
  EXPECT_TRUE(pending.is_due(kStart + 40ms, false));
  EXPECT_FALSE(pending.is_due(kStart + 1999ms, true));
  EXPECT_TRUE(pending.is_due(kStart + 2s, true));
}

TEST(PendingFrames, ANewerFrameEndsTheWait) {
  PendingFrames pending;
  pending.add(frame(5), kStart);
  pending.add(frame(6), kStart + 1ms);
  EXPECT_EQ(taken(pending, kStart + 1ms, false), Numbers{5});
  EXPECT_EQ(pending.size(), 1u);
  EXPECT_FALSE(pending.is_due(kStart + 40ms, false)) << "frame 6 began to wait after 1 ms";
  EXPECT_EQ(taken(pending, kStart + 41ms, false), Numbers{6});
  EXPECT_TRUE(pending.empty());
}

TEST(PendingFrames, EachFrameOfALosslessReplayWaitsForItself) {
  PendingFrames pending;
  for (const std::uint64_t number : {5, 6, 7}) pending.add(frame(number), kStart);
  EXPECT_EQ(taken(pending, kStart + 1s, true), Numbers{});
  EXPECT_EQ(taken(pending, kStart + 2s, true), Numbers{5});
  EXPECT_EQ(taken(pending, kStart + 3s, true), Numbers{}) << "frame 6 waits since 2 s";
  EXPECT_EQ(taken(pending, kStart + 4s, true), Numbers{6});
}

// The frames of the replay are composited before the newer one, in their order.
TEST(PendingFrames, AreDueInTheirOrderWhenALosslessReplayEnds) {
  PendingFrames pending;
  for (const std::uint64_t number : {5, 6, 7}) pending.add(frame(number), kStart);
  EXPECT_EQ(taken(pending, kStart, true), Numbers{});
  pending.add(frame(8), kStart + 1ms);
  EXPECT_EQ(taken(pending, kStart + 1ms, false), (Numbers{5, 6, 7}));
  EXPECT_EQ(pending.first().front().frame, 8u);
  pending.clear();
  EXPECT_TRUE(pending.empty());
}

}  // namespace
}  // namespace fivepipe::render
