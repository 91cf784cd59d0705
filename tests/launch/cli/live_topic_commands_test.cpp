#include "tests/launch/cli/recording_commands.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <thread>

#include "common/base/timing.h"
#include "common/pipeline/bus/bus.h"
#include "tests/support/deployments.h"
#include "tests/support/process.h"
#include "tests/support/process/cpu_time.h"
#include "tests/support/test_domain.h"
#include "tests/support/test_folder.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;

// Writes frames on the bus while it exists.
class LiveWriter {
 public:
  explicit LiveWriter(std::uint32_t domain)
      : bus_({domain, "loopback", "render_x"}),
        writer_(bus_.writer<bus::topics::FrameComposited>()),
        thread_([this](std::stop_token stop) {
          fivepipe_v1_FrameComposited message{};
          std::snprintf(message.viewer, sizeof message.viewer, "viewer");
          for (; !stop.stop_requested(); ++message.frame, std::this_thread::sleep_for(10ms))
            writer_.write(message);
        }) {}

 private:
  bus::Bus bus_;
  bus::Writer<bus::topics::FrameComposited> writer_;
  std::jthread thread_;
};

TEST(RecordingCommandsLive, ShowTopicsWritersAndRates) {
  const std::uint32_t domain = test::own_domain();
  const LiveWriter writer(domain);
  const std::string in_domain = " --domain " + std::to_string(domain);
  const Answer ls = fivepipe("ls" + in_domain);
  EXPECT_EQ(ls.exit_code, 0) << ls.text;
  EXPECT_TRUE(holds(ls, kCompositedTopic + "  " + kCompositedType) && holds(ls, "reliable, last") &&
              holds(ls, "render_x"))
      << ls.text;
  EXPECT_EQ(fivepipe("ls --nodes" + in_domain).text,
            "node      writes           reads\nrender_x  FrameComposited  -\n");

  const Answer echo = fivepipe("echo FrameComposited --field viewer --count 3" + in_domain);
  EXPECT_EQ(echo.exit_code, 0) << echo.text;
  EXPECT_EQ(std::count(echo.text.begin(), echo.text.end(), '\n'), 3) << echo.text;
  EXPECT_TRUE(echo.text.starts_with("--- viewer  # ") && holds(echo, " render_x, latency "))
      << echo.text;
  const Answer head = shell("bash -c 'set -o pipefail; " + program + "echo FrameComposited" +
                            in_domain + " | head -n 2'");
  EXPECT_EQ(head.exit_code, 0) << head.text;

  const Answer hz = fivepipe("hz FrameComposited --once 1.5" + in_domain);
  EXPECT_EQ(hz.exit_code, 0) << hz.text;
  EXPECT_TRUE(holds(hz, "render_x") && holds(hz, "frames, none missing")) << hz.text;
}

TEST(RecordingCommandsLive, EchoReportsUnregisteredWriterAndExits) {
  const std::uint32_t domain = test::own_domain();
  auto writer = std::make_optional<LiveWriter>(domain);
  FILE* echo = popen(
      (program + "echo FrameComposited --json --domain " + std::to_string(domain)).c_str(), "r");
  ASSERT_TRUE(echo);
  char line[4096];
  ASSERT_TRUE(fgets(line, sizeof line, echo));
  writer.reset();
  while (std::string(line).find("key_change") == std::string::npos)
    ASSERT_TRUE(fgets(line, sizeof line, echo));
  const auto last = nlohmann::json::parse(line);
  EXPECT_EQ(last["key_change"], "unregistered");
  EXPECT_EQ(last["key"]["viewer"], "viewer");
  EXPECT_EQ(last["writer"], "render_x");
  EXPECT_EQ(pclose(echo), 0) << "echo did not exit when its reader closed the pipe";
}

// Expects that the commands which `run` starts sleep while they wait. Their start is not a wait. It
// needs the CPU time of a command that joins the domain and ends, or twice as much at most.
void expect_sleep(std::uint32_t domain, int command_count, const std::function<void()>& run) {
  const double first_s = test::children_cpu_s();
  fivepipe("hz HeadPose --once 0.01 --domain " + std::to_string(domain));
  const double before_s = test::children_cpu_s();
  const auto start = std::chrono::steady_clock::now();
  run();
  EXPECT_LT(test::children_cpu_s() - before_s,
            2 * command_count * (before_s - first_s) +
                test::kMaxWaitingShare * base::seconds_since(start));
}

TEST(RecordingCommandsLive, ReportEmptyDomain) {
  const std::uint32_t domain = test::own_domain();
  const std::string in_domain = " --domain " + std::to_string(domain);
  Answer ls;
  expect_sleep(domain, 1, [&] { ls = fivepipe("ls" + in_domain); });  // waits for 1.5 s
  EXPECT_EQ(ls.exit_code, 3) << ls.text;
  EXPECT_TRUE(holds(ls, "no participant")) << ls.text;
  EXPECT_EQ(fivepipe("hz HeadPose --once 0.3" + in_domain).exit_code, 3);
  EXPECT_EQ(fivepipe("echo NoSuchTopic" + in_domain).exit_code, 2);
}

TEST(RecordingCommandsLive, SimulationCommandsReachTheirNode) {
  const std::uint32_t domain = test::own_domain();
  const std::string in_domain = " --domain " + std::to_string(domain), longest(32, 'n');
  Answer alone;
  expect_sleep(domain, 1, [&] { alone = fivepipe("simulation pause" + in_domain); });  // for 3 s
  EXPECT_EQ(alone.exit_code, 3);
  EXPECT_EQ(alone.text, "no sim_node listens in domain " + std::to_string(domain) +
                            "; --domain selects another one, and a deployment on several hosts "
                            "needs --deployment FILE; `fivepipe top" +
                            in_domain + "` lists the running nodes\n");
  bus::Bus bus({domain});
  auto commands = bus.reader<bus::topics::Command>();
  const Answer too_long = fivepipe("simulation pause --node " + longest + "n" + in_domain);
  EXPECT_EQ(too_long.exit_code, 2);
  EXPECT_EQ(too_long.text, "--node: a node's name has at most 32 characters\n");
  for (const auto& [what, target] : std::vector<std::pair<std::string, std::string>>{
           {"pause", ""}, {"resume", "sim"}, {"reset", longest}}) {
    const Answer sent =
        fivepipe("simulation " + what + (target.empty() ? "" : " --node " + target) + in_domain);
    EXPECT_EQ(sent.exit_code, 0) << sent.text;
    EXPECT_EQ(sent.text, "");
    int received = 0;
    for (const auto& command : commands.take()) {
      if (!command.valid()) continue;
      ++received;
      EXPECT_EQ(command->target, target);
      EXPECT_EQ(command->kind, what == "pause"    ? fivepipe_v1_pause_simulation
                               : what == "resume" ? fivepipe_v1_resume_simulation
                                                  : fivepipe_v1_reset_simulation);
    }
    EXPECT_EQ(received, 1) << what;
  }
}

TEST(RecordingCommandsLive, ASimulationOfADeploymentTakesOnlyItsCommands) {
  const std::uint32_t domain = test::own_domain();
  const std::string in_domain = " --domain " + std::to_string(domain);
  bus::Bus bus({.domain = domain, .deployment = "small"});
  auto commands = bus.reader<bus::topics::Command>();
  const Answer refused = fivepipe("simulation pause" + in_domain);
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_EQ(refused.text,
            "the sim_node in domain " + std::to_string(domain) +
                " belongs to deployment 'small' and accepts only its commands: add --deployment "
                "and its file\n");
  const Answer sent =
      fivepipe("simulation pause --deployment " + test::kSmallDeployment + in_domain);
  EXPECT_EQ(sent.exit_code, 0) << sent.text;
  int received = 0;
  for (const auto& command : commands.take()) received += command.valid();
  EXPECT_EQ(received, 1);
}

TEST(RecordingCommandsLive, TopPrintsOneTableOfTheNodes) {
  const std::uint32_t domain = test::own_domain();
  bus::Bus bus({domain});
  auto writer = bus.writer<bus::topics::NodeStatus>();
  const std::jthread publishing([&](std::stop_token stop) {
    fivepipe_v1_NodeStatus status{};
    std::snprintf(status.node, sizeof status.node, "sim");
    status.start_stamp_ns = start_ns;
    status.frame = 7;
    for (; !stop.stop_requested(); std::this_thread::sleep_for(50ms)) writer.write(status);
  });
  const Answer top = fivepipe("top --once --domain " + std::to_string(domain));
  EXPECT_EQ(top.exit_code, 0) << top.text;
  const std::regex of_node("node +host +state +frame .*\nsim +[^ ]+ +running +7 +0\\.0 [^]*");
  EXPECT_TRUE(std::regex_match(top.text, of_node)) << top.text;
  EXPECT_EQ(std::count(top.text.begin(), top.text.end(), '\n'), 3) << top.text;
  EXPECT_FALSE(holds(top, "kinetic J")) << "nothing is simulated: " << top.text;
  // A status names a frame but belongs to none.
  const Answer hz = fivepipe("hz NodeStatus --once 0.5 --domain " + std::to_string(domain));
  EXPECT_EQ(hz.exit_code, 0) << hz.text;
  EXPECT_FALSE(holds(hz, " frame")) << hz.text;
}

TEST(RecordingCommandsLive, TopPrintsTheMetricsOfASimulation) {
  const std::uint32_t domain = test::own_domain();
  bus::Bus bus({domain});
  auto statuses = bus.writer<bus::topics::NodeStatus>();
  auto metrics = bus.writer<bus::topics::SimulationMetrics>();
  const std::jthread publishing([&](std::stop_token stop) {
    fivepipe_v1_NodeStatus status{};
    std::snprintf(status.node, sizeof status.node, "sim");
    status.start_stamp_ns = start_ns;
    fivepipe_v1_SimulationMetrics message{};
    std::snprintf(message.simulation, sizeof message.simulation, "sim");
    fivepipe_v1_BodyMetrics bodies{2, 1.25, 3.5, 4, 1, 0.0012, 0.0003};
    message.bodies = {1, 1, &bodies, false};
    for (; !stop.stop_requested(); std::this_thread::sleep_for(50ms)) {
      statuses.write(status);
      metrics.write(message);
    }
  });
  const Answer top = fivepipe("top --once --domain " + std::to_string(domain));
  EXPECT_EQ(top.exit_code, 0) << top.text;
  EXPECT_TRUE(holds(top, "\nsim             bodies: 2             1.250        3.500  "))
      << top.text;
  EXPECT_TRUE(holds(top, "1.2/1.2")) << top.text;
}

// Runs `fivepipe` until it has printed `lines` lines, calls `meanwhile`, then interrupts it.
// Returns its exit code and the lines.
Answer interrupted(
    const std::vector<std::string>& words, std::ptrdiff_t lines,
    const std::function<void()>& meanwhile = [] {}) {
  const test::TestFolder folder;
  std::vector<std::string> all{FIVEPIPE_BINARY_DIR "/fivepipe"};
  all.insert(all.end(), words.begin(), words.end());
  test::Program program(all, folder.path / "said");
  const auto printed = [&] {
    const std::string said = program.said();
    return std::count(said.begin(), said.end(), '\n') >= lines;
  };
  for (const auto until = std::chrono::steady_clock::now() + 60s;
       !printed() && std::chrono::steady_clock::now() < until;)
    std::this_thread::sleep_for(5ms);
  meanwhile();
  program.signal(SIGINT);
  const std::optional<int> exit_code = program.wait_for_end(60s);
  return {exit_code.value_or(-1), program.said()};
}

TEST(RecordingCommandsLive, EchoReportsThatItWaitsForAWriter) {
  const std::uint32_t domain_id = test::own_domain();
  const std::string domain = std::to_string(domain_id);
  const std::string waiting = "waiting: no node writes " + kHeadTopic + " in domain " + domain +
                              "; --domain selects another one, `fivepipe ls` lists the nodes, "
                              "Ctrl-C quits\n";
  Answer without_count;
  expect_sleep(domain_id, 2, [&] {
    without_count = interrupted({"echo", "HeadPose", "--domain", domain}, 1, [&] {
      const Answer echo = interrupted({"echo", "HeadPose", "--count", "1", "--domain", domain}, 1);
      EXPECT_EQ(echo.exit_code, 130) << "no message arrived";
      EXPECT_EQ(echo.text, waiting);
    });
  });
  EXPECT_EQ(without_count.exit_code, 0);
  EXPECT_EQ(without_count.text, waiting) << "once, although it waits for twice as long";
}

TEST(RecordingCommandsLive, TopPrintsATableEachSecond) {
  const std::uint32_t domain_id = test::own_domain();
  const std::string domain = std::to_string(domain_id);
  Answer top;
  expect_sleep(domain_id, 1, [&] { top = interrupted({"top", "--domain", domain}, 2); });
  const std::string line =
      "no node publishes a status in domain " + domain +
      "; --domain selects another one, and a deployment on several hosts needs --deployment FILE\n";
  EXPECT_TRUE(top.text.starts_with(line + line)) << top.text;
  EXPECT_LT(std::count(top.text.begin(), top.text.end(), '\n'), 60) << "one per second";
  EXPECT_EQ(shell("timeout 60 " + program + "top --domain " + domain + " >/dev/full").exit_code, 1);
}

TEST(RecordingCommandsLive, HzPrintsTheMessagesOfTheLastSeconds) {
  const std::uint32_t domain = test::own_domain();
  const LiveWriter writer(domain);
  // A table and an empty line per second; the first one may come before the writer is discovered.
  const Answer hz = interrupted({"hz", "FrameComposited", "--domain", std::to_string(domain)}, 8);
  EXPECT_TRUE(holds(hz, "\nrender_x ") && holds(hz, " frames, ")) << hz.text;
}

TEST(RecordingCommandsLive, HzPrintsATableUntilItIsInterrupted) {
  const std::string domain = std::to_string(test::own_domain());
  const Answer hz = interrupted({"hz", "HeadPose", "--domain", domain}, 3);
  EXPECT_EQ(hz.exit_code, 0);
  EXPECT_TRUE(hz.text.starts_with(kHeadTopic + ", domain " + domain +
                                  ", the last 5 s; frames since the start\n"
                                  "no message; writers: 0\n\n"))
      << hz.text;
  const Answer once = fivepipe("hz HeadPose --once 0.2 --domain " + domain);
  EXPECT_EQ(once.exit_code, 3);
  EXPECT_EQ(once.text, kHeadTopic + ", domain " + domain + "\nno message; writers: 0\n");
}

}  // namespace
}  // namespace fivepipe::launch
