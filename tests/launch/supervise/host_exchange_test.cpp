// The exchange between the hosts of a deployment, over DDS.
#include "launch/supervise/hosts/host_exchange.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/node/capture_clock.h"
#include "tests/support/deployments.h"
#include "tests/support/process.h"
#include "tests/support/sanitizer.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using bus::topics::HostStatus;

config::Deployment deployment() {
  config::Deployment deployment = config::load_deployment(test::kSmallDeployment);
  deployment.hosts = {{"alpha", "10.0.0.1", ""}, {"beta", "10.0.0.2", ""}};
  return deployment;
}

bool eventually(const std::function<bool()>& condition) {
  const auto until = std::chrono::steady_clock::now() + 30s * test::kSlowdown;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(20ms);
  }
  return true;
}

class HostExchanges : public testing::Test {
 protected:
  bus::Bus bus_{{.domain = test::own_domain(), .deployment = "small"}};
  HostExchange alpha_{bus_, deployment(), {"alpha", "up"}};
  HostExchange beta_{bus_, deployment(), {"beta", "up"}};
};

TEST_F(HostExchanges, TwoHostsCompareTheirClocksAndFiles) {
  const auto step = [&] {
    alpha_.step();
    beta_.step();
  };
  ASSERT_TRUE(eventually([&] {
    step();
    return !alpha_.others().empty() && alpha_.others()[0].clock && !beta_.others().empty() &&
           beta_.others()[0].clock;
  }));
  const ComparedHost beta = alpha_.others().front();
  EXPECT_EQ(beta.state.speaker, (HostSpeaker{"beta", "up"}));
  EXPECT_EQ(beta.state.version, alpha_.own().version);
  EXPECT_EQ(beta.state.files, checksums_of(deployment()));
  EXPECT_FALSE(beta.state.files.empty());
  EXPECT_LE(std::abs(beta.clock->offset_ns), beta.clock->error_ns);
  EXPECT_LT(beta.clock->error_ns, 100'000'000 * test::kSlowdown);
  // The nodes read what `up` has measured.
  node::CaptureClock seen(bus_, "beta", "alpha"), by_nobody(bus_, "gamma", "alpha");
  EXPECT_EQ(seen.offset_ns(), std::nullopt);
  EXPECT_TRUE(eventually([&] {
    step();
    seen.update();
    by_nobody.update();
    return seen.offset_ns().has_value();
  }));
  EXPECT_EQ(by_nobody.offset_ns(), std::nullopt);
}

// A message of a replay answers messages of the past.
TEST_F(HostExchanges, AnAnswerToNoMessageIsIgnored) {
  auto writer = bus_.writer<HostStatus>();
  ASSERT_TRUE(eventually([&] {
    const std::int64_t now_ns = base::now_realtime_ns();
    std::vector<fivepipe_v1_ClockAnswer> clocks(1);
    messages::set_text(clocks[0].host, "alpha");
    messages::set_text(clocks[0].program, "up");
    clocks[0].sent_ns = now_ns - 1'000'000;
    clocks[0].received_ns = now_ns;
    fivepipe_v1_HostStatus message{};
    messages::set_text(message.host, "beta");
    messages::set_text(message.program, "up");
    message.sent_ns = now_ns;
    messages::borrow(message.clocks, clocks);
    writer.write(message);
    alpha_.step();
    return !alpha_.others().empty();
  }));
  for (int i = 0; i < 5; ++i) {
    alpha_.step();
    std::this_thread::sleep_for(20ms);
  }
  for (const ComparedHost& other : alpha_.others())
    EXPECT_EQ(other.clock, std::nullopt) << other.state.speaker.host;
}

TEST_F(HostExchanges, OnlyTheHostsOfTheDeploymentPublish) {
  auto writer = bus_.writer<HostStatus>();
  ASSERT_TRUE(eventually([&] { return writer.readers() >= 2; }));
  for (const auto& [host, program] :
       {std::pair{"gamma", "up"}, std::pair{"beta", "top"}, std::pair{"beta", "doctor"}}) {
    fivepipe_v1_HostStatus message{};
    messages::set_text(message.host, host);
    messages::set_text(message.program, program);
    writer.write(message);
  }
  EXPECT_TRUE(writer.wait_for_delivery(5s));
  alpha_.step();
  std::vector<HostSpeaker> speakers;
  for (const ComparedHost& other : alpha_.others()) speakers.push_back(other.state.speaker);
  EXPECT_EQ(speakers, (std::vector<HostSpeaker>{{"beta", "doctor"}}));
}

// The peer sends the statuses of host beta, and others, by an impossible clock.
TEST_F(HostExchanges, AHostilePeerDoesNotDisturbTheComparison) {
  const test::TestFolder folder;
  test::Program peer({FIVEPIPE_BINARY_DIR "/hostile_peer", std::to_string(test::own_domain()), "60",
                      "1000", "HostStatus", "--deployment", "small"},
                     folder.path / "peer.log");
  auto hostile = bus_.reader<HostStatus>();
  std::size_t sent_for_beta = 0;
  EXPECT_TRUE(eventually([&] {
    alpha_.step();
    beta_.step();
    for (const auto& sample : hostile.take())
      sent_for_beta += sample.valid() && sample->host == std::string_view("beta") &&
                       sample->version != beta_.own().version;
    for (const ComparedHost& other : alpha_.others()) {
      EXPECT_EQ(other.state.speaker, (HostSpeaker{"beta", "up"}));
      EXPECT_EQ(other.state.version, beta_.own().version);
      EXPECT_EQ(other.state.files, beta_.own().files);
    }
    return HasFailure() ||
           (sent_for_beta > 500 && !alpha_.others().empty() && alpha_.others()[0].clock);
  })) << sent_for_beta
      << '\n'
      << peer.said();
  EXPECT_TRUE(HostChecks(false).check(alpha_.own(), alpha_.others(), alpha_.is_starting()).empty());
}

TEST(HostState, LeavesOutAClockWithAnImpossibleError) {
  std::vector<fivepipe_v1_ClockAnswer> clocks(4);
  const std::int64_t errors_ns[] = {-1, -2, INT64_MIN, 7};
  for (std::size_t i = 0; i < clocks.size(); ++i) {
    messages::set_text(clocks[i].host, "host" + std::to_string(i));
    clocks[i].error_ns = errors_ns[i];
  }
  fivepipe_v1_HostStatus message{};
  messages::borrow(message.clocks, clocks);
  const HostState state = state_from(message);
  ASSERT_EQ(state.clocks.size(), 1u);
  EXPECT_EQ(state.clocks.begin()->first.host, "host3");
  EXPECT_EQ(state.clocks.begin()->second.error_ns, 7);
}

TEST(Checksums, HaveTheSameNamesWhereverTheDeploymentIsNamedFrom) {
  const std::filesystem::path before = std::filesystem::current_path();
  const Checksums absolute = checksums_of(deployment());
  std::filesystem::current_path(std::filesystem::path(test::kSmallDeployment).parent_path());
  const Checksums relative = checksums_of(config::load_deployment("deployment.yaml"));
  std::filesystem::current_path(before);
  EXPECT_EQ(absolute, relative);
  EXPECT_TRUE(relative.contains("rig.yaml"));
  EXPECT_TRUE(relative.contains("deployment.yaml"));
}

}  // namespace
}  // namespace fivepipe::launch
