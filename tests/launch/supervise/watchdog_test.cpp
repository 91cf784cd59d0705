#include "launch/supervise/watchdog.h"

#include <gtest/gtest.h>

#include "common/base/process/heartbeat.h"

namespace fivepipe::launch {
namespace {

// A node whose process and loop beat as long as they are said to; steps of 50 ms.
class WatchdogTest : public testing::Test {
 protected:
  // Returns the verdict after this time, or the first one that is not empty.
  std::string after(double time_s, bool process_beats, bool loop_beats, double step_s = 0.05) {
    for (double at_s = 0; at_s < time_s - 1e-9; at_s += step_s) {
      process_ += process_beats;
      loop_ += loop_beats;
      const std::string why = watchdog_.step(process_, loop_, step_s, handles_frames_);
      if (!why.empty()) return why;
    }
    return "";
  }
  Watchdog watchdog_;
  std::uint64_t process_ = 1, loop_ = 1;
  bool handles_frames_ = true;
};

TEST_F(WatchdogTest, AProcessThatStopsIsNamedAfterASecond) {
  EXPECT_EQ(after(5, true, true), "");
  EXPECT_EQ(after(0.95, false, false), "");
  EXPECT_EQ(after(0.15, false, false), "no heartbeat for 1.0 s");
}

TEST_F(WatchdogTest, APauseIsForgotten) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(after(0.9, false, false), "");
    EXPECT_EQ(after(0.05, true, true), "");
  }
}

// The status thread still runs.
TEST_F(WatchdogTest, ALoopThatDoesNotRunIsNamedAfterThirtySeconds) {
  EXPECT_EQ(after(1, true, true), "");
  EXPECT_EQ(after(29.9, true, false), "");
  EXPECT_EQ(after(0.2, true, false), "its main loop has not run for 30 s");
}

// A node learns backgrounds and compiles shaders before its first frame.
TEST_F(WatchdogTest, ALoopNeedNotRunUntilTheFirstFrame) {
  handles_frames_ = false;
  EXPECT_EQ(after(100, true, false), "");
  handles_frames_ = true;
  EXPECT_EQ(after(29.9, true, false), "") << "counts from the first frame";
}

TEST_F(WatchdogTest, AProcessThatHasNotBegunOrEndsIsNotStalled) {
  process_ = 0;
  EXPECT_EQ(after(100, false, false), "");
  process_ = base::Beats::kEnding;
  EXPECT_EQ(after(100, false, false), "");
}

// The supervisor was paused too: of a pause of ten seconds it saw one step.
TEST_F(WatchdogTest, APauseOfTheWholeMachineCountsAsOneStep) {
  EXPECT_EQ(after(1, true, true), "");
  EXPECT_EQ(after(90, false, false, 10), "") << "nine steps of 0.1 s";
  EXPECT_NE(after(30, false, false, 10), "");
}

TEST_F(WatchdogTest, TimeThatRunsBackwardsCountsNothing) {
  EXPECT_EQ(after(1, true, true), "");
  for (int i = 0; i < 100; ++i) EXPECT_EQ(watchdog_.step(process_, loop_, -1, true), "");
}

}  // namespace
}  // namespace fivepipe::launch
