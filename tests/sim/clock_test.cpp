// The simulation's clock without a simulation: how times become steps.
#include "sim_node/simulation/simulation_clock.h"

#include <gtest/gtest.h>

namespace fivepipe::sim {
namespace {

constexpr double kStep_s = 1.0 / 240;

TEST(SimulationClock, FirstTimeSetsTheClockWithoutSteps) {
  SimulationClock clock(kStep_s);
  EXPECT_EQ(clock.advance_to(1e6), 0u);
  EXPECT_EQ(clock.time_s(), 1e6);
}

TEST(SimulationClock, StepsAddUpToTheTimeWithoutDrift) {
  SimulationClock clock(kStep_s);
  clock.advance_to(0);
  std::uint64_t steps = 0;
  constexpr int kFrames = 90000;  // 50 minutes at 30 Hz
  for (int frame = 1; frame <= kFrames; ++frame) steps += clock.advance_to(frame / 30.0);
  EXPECT_EQ(steps, 8u * kFrames);
  EXPECT_NEAR(clock.time_s(), kFrames / 30.0, 1e-9);
}

TEST(SimulationClock, IncompleteStepWaitsForTheNextTime) {
  SimulationClock clock(kStep_s);
  clock.advance_to(0);
  EXPECT_EQ(clock.advance_to(0.9 * kStep_s), 0u);
  EXPECT_EQ(clock.time_s(), 0);
  EXPECT_EQ(clock.advance_to(1.1 * kStep_s), 1u);
  EXPECT_EQ(clock.advance_to(2 * kStep_s - 1e-10), 1u) << "a stamp is rounded to a nanosecond";
}

TEST(SimulationClock, SkipsWhatExceedsTheCatchUp) {
  SimulationClock clock(kStep_s);
  clock.advance_to(0);
  EXPECT_EQ(clock.advance_to(5), std::uint64_t(kMaxCatchUp_s / kStep_s));
  EXPECT_NEAR(clock.counters().skipped_s, 5 - kMaxCatchUp_s, 1e-12);
  EXPECT_NEAR(clock.time_s(), 5, 1e-9);
}

TEST(SimulationClock, CatchUpWithinTheLimitSkipsNothing) {
  SimulationClock clock(kStep_s);
  clock.advance_to(0);
  EXPECT_EQ(clock.advance_to(kMaxCatchUp_s), 60u);
  EXPECT_EQ(clock.counters().skipped_s, 0);
}

// A catch-up of kMaxCatchUp_s may end with one more step, which was due before.
TEST(SimulationClock, SkipsOnlyMoreThanTheCatchUpAndOneStep) {
  constexpr double kEighth_s = 0.125;  // exact in binary, as is kMaxCatchUp_s
  SimulationClock clock(kEighth_s);
  EXPECT_EQ(clock.time_s(), 0);
  clock.advance_to(1);
  EXPECT_EQ(clock.advance_to(1 + kMaxCatchUp_s + kEighth_s), 3u);
  EXPECT_EQ(clock.counters().skipped_s, 0);
  EXPECT_EQ(clock.advance_to(clock.time_s() + kMaxCatchUp_s + kEighth_s + 0.0625), 2u);
  EXPECT_EQ(clock.counters().skipped_s, kEighth_s + 0.0625);
  EXPECT_EQ(clock.advance_to(clock.time_s() + 4), 2u);
  EXPECT_EQ(clock.counters().skipped_s, kEighth_s + 0.0625 + 4 - kMaxCatchUp_s);
}

TEST(SimulationClock, BackwardTimeUpToTheCatchUpIsIgnored) {
  SimulationClock clock(kStep_s);
  clock.advance_to(1);
  EXPECT_EQ(clock.advance_to(1 - kMaxCatchUp_s), 0u);
  EXPECT_EQ(clock.time_s(), 1);
  EXPECT_EQ(clock.advance_to(0.999 - kMaxCatchUp_s), 0u);
  EXPECT_EQ(clock.time_s(), 0.999 - kMaxCatchUp_s);
  EXPECT_EQ(clock.counters().backward_stamps, 2u);
}

TEST(SimulationClock, TimesWithinANanosecondAreEqual) {
  SimulationClock clock(kStep_s);
  clock.advance_to(0);
  for (const double time_s : {-0.9e-9, -1e-9}) EXPECT_EQ(clock.advance_to(time_s), 0u);
  EXPECT_EQ(clock.counters().backward_stamps, 0u);
  EXPECT_EQ(clock.advance_to(-1.1e-9), 0u);
  EXPECT_EQ(clock.counters().backward_stamps, 1u);
  EXPECT_EQ(clock.advance_to(kStep_s - 1.1e-9), 0u);
  EXPECT_EQ(clock.advance_to(kStep_s - 0.9e-9), 1u);
  constexpr double kNanosecondEarly_s = 2 * kStep_s - 1e-9;
  static_assert(kNanosecondEarly_s + 1e-9 == 2 * kStep_s);
  EXPECT_EQ(clock.advance_to(kNanosecondEarly_s), 1u);
}

TEST(SimulationClock, SettingTheClockDropsItsSteps) {
  SimulationClock clock(kStep_s);
  clock.advance_to(100);
  EXPECT_EQ(clock.advance_to(100 + 6 * kStep_s), 6u);
  EXPECT_EQ(clock.advance_to(10), 0u);
  EXPECT_EQ(clock.time_s(), 10);
}

TEST(SimulationClock, SmallBackwardTimeIsIgnoredAndCounted) {
  SimulationClock clock(kStep_s);
  clock.advance_to(1);
  EXPECT_EQ(clock.advance_to(1 - 0.5 * kMaxCatchUp_s), 0u);
  EXPECT_EQ(clock.time_s(), 1);
  EXPECT_EQ(clock.counters().backward_stamps, 1u);
}

TEST(SimulationClock, LargeBackwardTimeSetsTheClock) {
  SimulationClock clock(kStep_s);
  clock.advance_to(100);
  EXPECT_EQ(clock.advance_to(1), 0u);
  EXPECT_EQ(clock.time_s(), 1);
  EXPECT_EQ(clock.counters().backward_stamps, 1u);
  EXPECT_EQ(clock.advance_to(1 + kStep_s), 1u);
}

TEST(SimulationClock, PauseIsNotSimulatedLater) {
  SimulationClock clock(kStep_s);
  clock.advance_to(0);
  clock.pause();
  EXPECT_EQ(clock.advance_to(10), 0u);
  EXPECT_EQ(clock.time_s(), 10);
  clock.resume();
  EXPECT_EQ(clock.advance_to(10 + 3 * kStep_s), 3u);
  EXPECT_EQ(clock.counters().skipped_s, 0);
}

}  // namespace
}  // namespace fivepipe::sim
