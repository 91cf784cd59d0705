#include <gtest/gtest.h>

#include "launch/supervise/restart.h"

using namespace fivepipe;

namespace {

const launch::ProcessExit sigkill{true, 9}, failed{false, 1}, bad_configuration{false, 2},
    no_hardware{false, 3}, clean{false, 0};

double delay_s(const launch::RestartDecision& after) {
  EXPECT_TRUE(std::holds_alternative<launch::Restart>(after));
  return std::holds_alternative<launch::Restart>(after) ? std::get<launch::Restart>(after).delay_s
                                                        : -1;
}

}  // namespace

TEST(RestartPolicy, DelayDoublesUpToItsLimit) {
  launch::RestartPolicy policy;
  for (const double expected_s : {0.25, 0.5, 1.0, 2.0, 4.0, 4.0, 4.0})
    EXPECT_EQ(delay_s(policy.on_exit(sigkill, 5.0)), expected_s);
}

TEST(RestartPolicy, TenSecondsOfUptimeResetTheDelay) {
  launch::RestartPolicy policy;
  policy.mark_healthy();
  policy.on_exit(sigkill, 5.0);
  EXPECT_EQ(delay_s(policy.on_exit(sigkill, 9.99)), 0.5);
  EXPECT_EQ(delay_s(policy.on_exit(sigkill, 10.0)), 0) << "frames are lost until it is back";
  EXPECT_EQ(delay_s(policy.on_exit(no_hardware, 10.0)), 0.25) << "the camera will not be back yet";
  EXPECT_EQ(delay_s(policy.on_exit(sigkill, 5.0)), 0.5);
}

TEST(RestartPolicy, RestartsAreNumberedOverAllDeaths) {
  launch::RestartPolicy policy;
  EXPECT_EQ(std::get<launch::Restart>(policy.on_exit(sigkill, 100)).number, 1);
  EXPECT_EQ(std::get<launch::Restart>(policy.on_exit(sigkill, 100)).number, 2);
}

TEST(RestartPolicy, ConfigurationAndHardwareErrorsBeforeTheFirstStatusEndTheDeployment) {
  EXPECT_EQ(
      std::get<launch::StopDeployment>(launch::RestartPolicy().on_exit(bad_configuration, 0.1))
          .exit_code,
      2);
  EXPECT_EQ(
      std::get<launch::StopDeployment>(launch::RestartPolicy().on_exit(no_hardware, 8.0)).exit_code,
      3);
}

TEST(RestartPolicy, FiveQuickExitsInARowStopDeployment) {
  launch::RestartPolicy policy;
  for (int i = 0; i < 4; ++i)
    EXPECT_TRUE(std::holds_alternative<launch::Restart>(policy.on_exit(failed, 1.99)));
  const auto after = policy.on_exit(failed, 1.99);
  ASSERT_TRUE(std::holds_alternative<launch::StopDeployment>(after));
  EXPECT_EQ(std::get<launch::StopDeployment>(after).exit_code, 1);
  EXPECT_NE(std::get<launch::StopDeployment>(after).reason.find("exit code 1"), std::string::npos);
}

TEST(RestartPolicy, ADispensableNodeNeverStopsTheDeployment) {
  launch::RestartSettings settings;
  settings.is_dispensable = true;
  for (const int code : {1, 2, 3}) {
    launch::RestartPolicy policy(settings);
    for (int i = 0; i < 20; ++i) {
      const auto after = policy.on_exit(launch::ProcessExit{false, code}, 0.1);
      ASSERT_TRUE(std::holds_alternative<launch::Restart>(after)) << code;
      EXPECT_LE(std::get<launch::Restart>(after).delay_s, settings.max_delay_s);
    }
    EXPECT_EQ(
        std::get<launch::Restart>(policy.on_exit(launch::ProcessExit{false, code}, 0.1)).delay_s,
        settings.max_delay_s);
  }
}

TEST(RestartPolicy, SlowExitResetsQuickExitCount) {
  launch::RestartPolicy policy;
  for (int i = 0; i < 4; ++i) policy.on_exit(failed, 0.1);
  EXPECT_TRUE(std::holds_alternative<launch::Restart>(policy.on_exit(failed, 2.0)));
  for (int i = 0; i < 4; ++i)
    EXPECT_TRUE(std::holds_alternative<launch::Restart>(policy.on_exit(failed, 0.1)));
}

// A user unplugs a camera and plugs it in minutes later.
TEST(RestartPolicy, MissingHardwareIsRetriedOnceHealthy) {
  launch::RestartPolicy policy;
  policy.mark_healthy();
  for (int i = 0; i < 50; ++i)
    ASSERT_TRUE(std::holds_alternative<launch::Restart>(policy.on_exit(no_hardware, 0.1)));
}

TEST(RestartPolicy, CleanExitIsNotRestarted) {
  EXPECT_TRUE(std::holds_alternative<launch::Ended>(launch::RestartPolicy().on_exit(clean, 0.1)));
}

TEST(RestartPolicy, AHealthyNodeWhoseConfigurationBreaksStopsTheDeploymentWithItsCode) {
  launch::RestartPolicy policy;
  policy.mark_healthy();
  for (int i = 1; i < 5; ++i)
    EXPECT_EQ(std::get<launch::Restart>(policy.on_exit(bad_configuration, 0.1)).number, i);
  const auto after = std::get<launch::StopDeployment>(policy.on_exit(bad_configuration, 0.1));
  EXPECT_EQ(after.exit_code, 2);
  EXPECT_EQ(after.reason,
            "cannot start: died 5 times in a row, last by exit code 2 (usage or configuration)");
  EXPECT_EQ(
      std::get<launch::StopDeployment>(launch::RestartPolicy().on_exit(no_hardware, 5)).reason,
      "cannot start: exit code 3 (hardware or peer missing)");
}

TEST(RestartPolicy, ASignalWithTheNumberOfAnExitCodeStatesNoReason) {
  for (const int number : {2, 3})
    EXPECT_EQ(std::get<launch::Restart>(launch::RestartPolicy().on_exit({true, number}, 1)).number,
              1);
  launch::RestartPolicy policy;
  policy.mark_healthy();
  for (int i = 0; i < 4; ++i) policy.on_exit({true, 3}, 0.1);
  EXPECT_EQ(std::get<launch::StopDeployment>(policy.on_exit({true, 3}, 0.1)).exit_code, 1);
}

// Waiting for hardware is no quick death, and does not end a row of such deaths either.
TEST(RestartPolicy, MissingHardwareCountsAsNoFailedStart) {
  launch::RestartPolicy policy;
  policy.mark_healthy();
  for (int i = 0; i < 4; ++i) policy.on_exit(failed, 0.1);
  EXPECT_EQ(delay_s(policy.on_exit(no_hardware, 0.1)), 4) << "no fifth failed start";
}

TEST(ProcessExit, HasReadableText) {
  EXPECT_EQ(launch::to_string(launch::ProcessExit{}), "exit code 0 (exited cleanly)");
  EXPECT_EQ(launch::to_string(failed), "exit code 1 (failed)");
  EXPECT_EQ(launch::to_string(bad_configuration), "exit code 2 (usage or configuration)");
  EXPECT_EQ(launch::to_string(launch::ProcessExit{false, 130}), "exit code 130 (interrupted)");
  EXPECT_EQ(launch::to_string(launch::ProcessExit{true, 63}), "killed by signal 63");
  EXPECT_EQ(launch::to_string(sigkill), "killed by signal 9 (SIGKILL)");
  EXPECT_EQ(launch::to_string(launch::ProcessExit{true, 11}), "killed by signal 11 (SIGSEGV)");
  EXPECT_EQ(launch::to_string(no_hardware), "exit code 3 (hardware or peer missing)");
  EXPECT_EQ(launch::to_string(launch::ProcessExit{false, 77}), "exit code 77");
}
