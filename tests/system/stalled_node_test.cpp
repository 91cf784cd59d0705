// Stalled nodes, with real processes and DDS.
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <cstdlib>
#include <map>
#include <thread>
#include <vector>

#include "tests/support/deployments.h"
#include "tests/support/process.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kStart = 60s;

bool is_long() { return std::getenv("FIVEPIPE_LONG") != nullptr; }

class StalledNode : public testing::Test {
 protected:
  // Whether `more` frames are composited within `timeout`.
  bool frames_go_on(int more, std::chrono::milliseconds timeout) {
    int seen = 0;
    composited_.take();
    return eventually(bus_, timeout, [&] {
      for (const auto& sample : composited_.take()) seen += sample.valid();
      return seen >= more;
    });
  }
  std::map<std::string, pid_t> pids(const Deployed& deployed) const {
    std::map<std::string, pid_t> pids;
    for (const std::string& node : kNodes) pids[node] = deployed.pid_of(node).value_or(0);
    return pids;
  }

  TestFolder folder_;
  std::uint32_t domain_ = own_domain();
  bus::Bus bus_{{domain_}};
  bus::Reader<bus::topics::FrameComposited> composited_ =
      bus_.reader<bus::topics::FrameComposited>();
};

TEST_F(StalledNode, IsNamedAndBackWithinTwoSeconds) {
  Deployed deployed(kSmallDeployment, domain_, folder_.path);
  ASSERT_TRUE(frames_go_on(20, kStart)) << deployed.said();
  for (const std::string& node : kNodes) {
    const std::optional<pid_t> stopped = deployed.pid_of(node);
    ASSERT_TRUE(stopped) << node << deployed.said();
    const auto at = Clock::now();
    kill(*stopped, SIGSTOP);
    while (deployed.pid_of(node).value_or(*stopped) == *stopped &&
           Clock::now() < at + 10s * kSlowdown)
      std::this_thread::sleep_for(10ms);
    const auto back = Clock::now() - at;
    EXPECT_LT(back, 2s * kSlowdown) << node << deployed.said();
    EXPECT_TRUE(contains(deployed.said(), node + " is stalled: no heartbeat for 1.")) << node;
    EXPECT_TRUE(frames_go_on(20, 20s * kSlowdown)) << node << deployed.said();
  }
}

TEST_F(StalledNode, IsNoneThatPausesShortly) {
  Deployed deployed(kSmallDeployment, domain_, folder_.path);
  ASSERT_TRUE(frames_go_on(20, kStart)) << deployed.said();
  const auto before = pids(deployed);
  // Also in the short run, the pauses of a node are together longer than the silence of a stalled
  // one.
  for (int i = 0; i < (is_long() ? 20 : 8); ++i)
    for (const std::string& node : kNodes) {
      kill(before.at(node), SIGSTOP);
      std::this_thread::sleep_for(150ms);
      kill(before.at(node), SIGCONT);
    }
  EXPECT_TRUE(frames_go_on(20, 20s * kSlowdown)) << deployed.said();
  EXPECT_EQ(pids(deployed), before) << deployed.said();
}

TEST_F(StalledNode, IsNoneOnABusyMachine) {
  Deployed deployed(kSmallDeployment, domain_, folder_.path);
  ASSERT_TRUE(frames_go_on(20, kStart)) << deployed.said();
  const auto before = pids(deployed);
  std::atomic<bool> is_over = false;
  std::vector<std::thread> loops;
  for (unsigned i = 0; i < std::thread::hardware_concurrency(); ++i)
    loops.emplace_back([&] {
      while (!is_over) {
      }
    });
  std::this_thread::sleep_for(is_long() ? 10s : 5s);
  is_over = true;
  for (std::thread& loop : loops) loop.join();
  EXPECT_TRUE(frames_go_on(20, 20s * kSlowdown)) << deployed.said();
  EXPECT_EQ(pids(deployed), before) << deployed.said();
}

// A debugger stops the nodes as it likes.
TEST_F(StalledNode, GoesOnLaterWithoutTheWatchdog) {
  Deployed deployed(kSmallDeployment, domain_, folder_.path, {"--no-watchdog"});
  ASSERT_TRUE(frames_go_on(20, kStart)) << deployed.said();
  const auto before = pids(deployed);
  kill(before.at("recon_a"), SIGSTOP);
  std::this_thread::sleep_for(3s);
  kill(before.at("recon_a"), SIGCONT);
  EXPECT_TRUE(frames_go_on(20, 20s * kSlowdown)) << deployed.said();
  EXPECT_EQ(pids(deployed), before) << deployed.said();
  // The same process is no second one.
  EXPECT_FALSE(contains(deployed.said(), "another deployment runs")) << deployed.said();
}

}  // namespace
}  // namespace fivepipe::test
