#include "launch/supervise/spacing/spacing_keeper.h"

#include <gtest/gtest.h>

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Due = std::map<std::string, double>;

const SpacingKeeper::Clock::time_point kStart = SpacingKeeper::Clock::now();

TEST(SpacingKeeper, RequestsWhatARestartedSimulationHasLost) {
  SpacingKeeper keeper;
  keeper.add({"a", 0.1, false});
  keeper.add({"b", 0.2, false});
  EXPECT_EQ(keeper.due(kStart), Due{}) << "nobody has moved anything";
  keeper.add({"a", 0.3, true});
  keeper.add({"a", 0.4, true});
  EXPECT_EQ(keeper.due(kStart), Due{}) << "the simulation has it";
  EXPECT_EQ(keeper.for_start(), (Due{{"a", 0.4}}));
  keeper.add({"a", 0.1, false});
  keeper.add({"b", 0.2, false});
  EXPECT_EQ(keeper.due(kStart), (Due{{"a", 0.4}}));
  EXPECT_EQ(keeper.due(kStart + SpacingKeeper::kRepeat - 1ms), Due{});
  EXPECT_EQ(keeper.due(kStart + SpacingKeeper::kRepeat), (Due{{"a", 0.4}})) << "no answer yet";
  keeper.add({"a", 0.4, true});
  EXPECT_EQ(keeper.due(kStart + 10s), Due{});
  EXPECT_EQ(keeper.for_start(), (Due{{"a", 0.4}})) << "also after the loss";
}

// The last message of a process that died may arrive when its successor has already started with
// the spacing before.
TEST(SpacingKeeper, TheAnswerOfASuccessorReplacesNoRequestThatBecameKnownAfterItsStart) {
  constexpr std::uint64_t kDead = 1, kSuccessor = 2, kThird = 3;
  SpacingKeeper keeper;
  keeper.add({"a", 0.4, true, kDead});
  EXPECT_EQ(keeper.for_start(), (Due{{"a", 0.4}}));
  keeper.add({"a", 0.5, true, kDead});
  EXPECT_EQ(keeper.due(kStart), Due{}) << "the successor does not answer yet";
  keeper.add({"a", 0.4, true, kSuccessor});
  EXPECT_EQ(keeper.due(kStart), (Due{{"a", 0.5}}));
  keeper.add({"a", 0.5, true, kSuccessor});
  EXPECT_EQ(keeper.due(kStart + 10s), Due{});
  keeper.add({"a", 0.4, true, kSuccessor});
  EXPECT_EQ(keeper.due(kStart + 10s), Due{}) << "a request";
  EXPECT_EQ(keeper.for_start(), (Due{{"a", 0.4}}));
  keeper.add({"a", 0.3, true, kThird});
  keeper.add({"a", 0.4, true, kThird});
  EXPECT_EQ(keeper.due(kStart + 10s), Due{}) << "both were requested from the third one";
  EXPECT_EQ(keeper.for_start(), (Due{{"a", 0.4}}));
}

TEST(SpacingKeeper, ASuccessorThatBeginsWithTheRequestHasIt) {
  SpacingKeeper keeper;
  keeper.add({"a", 0.4, true, 1});
  keeper.for_start();
  keeper.add({"a", 0.4, true, 2});
  EXPECT_EQ(keeper.due(kStart), Due{});
  keeper.for_start();
  keeper.add({"a", 0.1, false, 3});
  EXPECT_EQ(keeper.due(kStart), (Due{{"a", 0.4}})) << "it has not taken it";
}

TEST(SpacingKeeper, ALaterRequestReplacesTheLostOne) {
  SpacingKeeper keeper;
  keeper.add({"a", 0.4, true});
  keeper.add({"a", 0.1, false});
  keeper.add({"a", 0.25, true});
  EXPECT_EQ(keeper.due(kStart), Due{});
  keeper.add({"a", 0.1, false});
  EXPECT_EQ(keeper.due(kStart), (Due{{"a", 0.25}}));
}

TEST(SpacingKeeper, TheScenesSpacingIsNoLoss) {
  SpacingKeeper keeper;
  keeper.add({"a", 0.4, true});
  keeper.add({"a", 0.1, true});
  keeper.add({"a", 0.1, false});
  EXPECT_EQ(keeper.due(kStart), Due{});
}

}  // namespace
}  // namespace fivepipe::launch
