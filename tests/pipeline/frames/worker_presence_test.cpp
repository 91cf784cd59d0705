// Which reconstruction workers take part.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/pipeline/frames/worker_presence.h"

namespace fivepipe::frames {
namespace {

using namespace std::chrono_literals;
using Clock = WorkerPresence::Clock;
using Workers = std::vector<int>;
using Owners = std::vector<std::uint8_t>;

constexpr auto kPeriod = 33ms;

class WorkersThatAnswer : public testing::Test {
 protected:
  // Publishes frames, each answered by its owners and others at these times after its publication.
  void frames(int count, const std::vector<std::optional<Clock::duration>>& answer_after,
              const Owners& owners = {0, 1}) {
    for (int i = 0; i < count; ++i) {
      presence_.published(frame_, owners);
      std::vector<std::pair<Clock::duration, int>> order;
      for (int worker = 0; worker < int(answer_after.size()); ++worker)
        if (answer_after[std::size_t(worker)])
          order.emplace_back(*answer_after[std::size_t(worker)], worker);
      std::sort(order.begin(), order.end());
      for (const auto& [after, worker] : order) presence_.answered(frame_, worker, now_ + after);
      now_ += kPeriod;
      ++frame_;
      presence_.update(now_);
    }
  }
  // Returns after how long without an answer of worker 1 its tiles go to others.
  Clock::duration time_until_silent() {
    presence_.published(frame_, Owners{0, 1});
    presence_.answered(frame_, 0, now_);
    const auto start = now_;
    while (presence_.present() == Workers{0, 1} && now_ < start + 10s)
      presence_.update(now_ += 1ms);
    ++frame_;
    return now_ - start;
  }

  std::uint64_t frame_ = 7;
  Clock::time_point now_{1000s};
  WorkerPresence presence_{2};
};

TEST_F(WorkersThatAnswer, ArePresentFromTheStart) {
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
  frames(100, {5ms, 12ms});
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
  EXPECT_FALSE(presence_.take_lost());
}

TEST_F(WorkersThatAnswer, OneThatIsSilentLosesItsTilesAfterSixtyMilliseconds) {
  frames(20, {5ms, 12ms});
  EXPECT_EQ(time_until_silent(), WorkerPresence::kMinPatience + 1ms);
  EXPECT_EQ(presence_.present(), Workers{0});
  EXPECT_TRUE(presence_.is_missing(1));
  EXPECT_EQ(presence_.take_lost(), frame_ - 1);
  EXPECT_FALSE(presence_.take_lost());
}

TEST_F(WorkersThatAnswer, SlowOnesGetThreeTimesTheirDelay) {
  frames(int(WorkerPresence::kDelaysPerWorker), {5ms, 45ms});
  EXPECT_EQ(time_until_silent(), 3 * 40ms + 1ms);
}

TEST_F(WorkersThatAnswer, ThePatienceHasAnUpperBound) {
  frames(int(WorkerPresence::kDelaysPerWorker), {5ms, 605ms});
  EXPECT_EQ(time_until_silent(), 1800ms + 1ms);
  presence_ = WorkerPresence(2);
  frames(int(WorkerPresence::kDelaysPerWorker), {5ms, 4s});
  EXPECT_EQ(time_until_silent(), WorkerPresence::kMaxPatience + 1ms);
}

TEST_F(WorkersThatAnswer, TheFirstFramesMayTakeLonger) {
  frames(2, {5ms, 12ms});
  EXPECT_EQ(time_until_silent(), WorkerPresence::kFirstPatience + 1ms);
}

TEST_F(WorkersThatAnswer, AllOfThemMaySlowDownTogether) {
  frames(20, {5ms, 12ms});
  frames(20, {900ms, 920ms});
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
  // No worker answers, so none can take the tiles.
  frames(100, {{}, {}});
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
  EXPECT_FALSE(presence_.take_lost());
}

TEST_F(WorkersThatAnswer, OneThatDropsAFrameIsNotSilent) {
  frames(20, {5ms, 12ms});
  for (int i = 0; i < 20; ++i) {
    frames(1, {5ms, {}});
    frames(1, {5ms, 12ms});
  }
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
}

TEST_F(WorkersThatAnswer, OneComesBackByAnAnswerToANewFrame) {
  frames(20, {5ms, 12ms});
  const std::uint64_t first = frame_;
  frames(10, {5ms, {}}, {0, 0});
  time_until_silent();
  frames(3, {5ms, {}}, {0, 0});
  // What it had not read when it was stopped:
  for (std::uint64_t old = first; old < frame_ - WorkerPresence::kRecentFrames; ++old)
    presence_.answered(old, 1, now_);
  EXPECT_EQ(presence_.present(), Workers{0});
  presence_.answered(frame_ - WorkerPresence::kRecentFrames, 1, now_);
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
  EXPECT_FALSE(presence_.is_missing(1));
  frames(50, {5ms, 12ms});
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
}

TEST_F(WorkersThatAnswer, TheLastOneKeepsItsTiles) {
  frames(20, {5ms, 12ms});
  time_until_silent();
  presence_.take_lost();
  frames(20, {{}, {}}, {0, 0});
  EXPECT_EQ(presence_.present(), Workers{0});
  EXPECT_FALSE(presence_.take_lost());
}

TEST_F(WorkersThatAnswer, OneThatLeavesHasTimeForItsFrames) {
  frames(20, {5ms, 12ms});
  presence_.published(frame_, Owners{0, 1});
  presence_.answered(frame_, 0, now_);
  presence_.left(1);
  EXPECT_EQ(presence_.present(), Workers{0});
  EXPECT_TRUE(presence_.is_missing(1));
  EXPECT_TRUE(presence_.has_left(1));
  presence_.update(now_ + WorkerPresence::kMinPatience);
  EXPECT_FALSE(presence_.take_lost());
  // It may have ended by an error.
  presence_.update(now_ + WorkerPresence::kMinPatience + 1ms);
  EXPECT_EQ(presence_.take_lost(), frame_);
  presence_.update(now_ + 10s);
  EXPECT_FALSE(presence_.take_lost());
  presence_.left(0);
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
}

TEST_F(WorkersThatAnswer, OneThatReturnsHasNotLeft) {
  frames(20, {5ms, 12ms});
  presence_.left(1);
  frames(1, {5ms, 6ms}, {0, 0});
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
  EXPECT_FALSE(presence_.has_left(1));
}

// Forty frames are in flight.
TEST_F(WorkersThatAnswer, AnswersMayComeManyFramesLater) {
  const auto late = [&](int count, bool both) {
    for (int i = 0; i < count; ++i, ++frame_) {
      presence_.published(frame_, Owners{0, 1});
      presence_.answered(frame_ - 40, 0, now_);
      if (both) presence_.answered(frame_ - 40, 1, now_ + 5ms);
      presence_.update(now_ += kPeriod);
    }
  };
  frame_ = 1000;
  late(100, true);
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
  late(10, false);
  EXPECT_EQ(presence_.present(), Workers{0});
  late(2, true);
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
}

TEST_F(WorkersThatAnswer, OneThatNeverCameIsNotMissed) {
  EXPECT_EQ(time_until_silent(), WorkerPresence::kMinPatience + 1ms);
  frames(40, {5ms, {}});
  EXPECT_EQ(presence_.present(), Workers{0});
  EXPECT_FALSE(presence_.is_missing(1));
}

// split: frames. The others answer at once that they have no tile.
TEST_F(WorkersThatAnswer, TheOwnerOfAWholeFrameMayTakeItsTime) {
  for (int i = 0; i < 40; ++i) {
    frames(1, {25ms, 1ms}, {0, 0});
    frames(1, {1ms, 25ms}, {1, 1});
  }
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
  EXPECT_EQ(time_until_silent(), 3 * 24ms + 1ms);
}

TEST_F(WorkersThatAnswer, UnknownFramesAndWorkersAreIgnored) {
  frames(20, {5ms, 12ms});
  presence_.answered(frame_, 1, now_);
  presence_.answered(frame_ - 1, -1, now_);
  presence_.answered(frame_ - 1, 2, now_);
  presence_.left(-1);
  presence_.left(2);
  presence_.published(frame_, Owners{0, 200});
  presence_.update(now_ + 10s);
  EXPECT_EQ(presence_.present(), (Workers{0, 1}));
}

TEST(WorkerPresence, OneOfThreeLeavesItsTilesToTwo) {
  WorkerPresence presence(3);
  Clock::time_point now{1000s};
  for (std::uint64_t frame = 0; frame < 40; ++frame, now += kPeriod) {
    presence.published(frame, Owners{0, 1, 2});
    for (int worker = 0; worker < 3; ++worker)
      if (frame < 20 || worker != 1) presence.answered(frame, worker, now + 5ms);
    presence.update(now);
  }
  EXPECT_EQ(presence.present(), (Workers{0, 2}));
}

}  // namespace
}  // namespace fivepipe::frames
