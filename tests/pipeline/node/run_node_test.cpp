#include "common/pipeline/node/run_node.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <set>
#include <vector>

#include "common/base/version.h"
#include "tests/support/test_domain.h"
#include "tests/support/text.h"

namespace fivepipe::node {
namespace {

const std::string kDemo = FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml";

int run_sim_node(const std::string& node, const std::function<void(NodeContext&)>& body,
                 const std::string& deployment = kDemo) {
  std::vector<std::string> words = {"sim_node",
                                    "--deployment",
                                    deployment,
                                    "--node",
                                    node,
                                    "--domain",
                                    std::to_string(test::own_domain()),
                                    "--out",
                                    "the folder"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  return run_node("sim_node", int(argv.size()), argv.data(), body);
}

// The exit code of a node in this process, and what it logs and prints.
struct Ended {
  int exit_code;
  std::string said;
};
Ended ended(const std::string& node, const std::function<void(NodeContext&)>& body,
            const std::string& deployment = kDemo) {
  const std::shared_ptr<spdlog::logger> before = spdlog::default_logger();
  testing::internal::CaptureStderr();
  const int exit_code = run_sim_node(node, body, deployment);
  Ended result{exit_code, testing::internal::GetCapturedStderr()};
  spdlog::set_default_logger(before);
  spdlog::drop("sim_node");
  return result;
}

TEST(RunNode, GivesTheBodyItsNode) {
  int calls = 0;
  const Ended done = ended("simulation", [&](NodeContext& context) {
    ++calls;
    EXPECT_TRUE(running());
    EXPECT_EQ(context.node.name, "simulation");
    EXPECT_EQ(config::program_of(context.node), "sim_node");
    EXPECT_FALSE(context.deployment.nodes.empty());
    EXPECT_EQ(context.out, "the folder");
    std::set<std::string> own_participants;
    for (const bus::EndpointDescription& endpoint : context.bus.endpoints())
      if (endpoint.own) own_participants.insert(endpoint.participant);
    EXPECT_EQ(own_participants, std::set<std::string>{"simulation"});
    config_of<config::SimConfig>(context);
  });
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_EQ(calls, 1);
  EXPECT_FALSE(test::contains(done.said, "is a Release build")) << done.said;
  EXPECT_EQ(test::contains(done.said, "many times slower"),
            std::string(base::build_type()) != "Release");
}

TEST(RunNode, ExitCodesAndLogsStateTheFailure) {
  const Ended missing =
      ended("simulation", [](NodeContext&) { throw NodeFailure(3, "no camera"); });
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_TRUE(test::contains(missing.said, " critical no camera\n")) << missing.said;
  const Ended failed =
      ended("simulation", [](NodeContext&) { throw std::runtime_error("out of memory"); });
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_TRUE(test::contains(failed.said, " critical out of memory\n")) << failed.said;
  const auto never = [](NodeContext&) { FAIL(); };
  const Ended unknown = ended("absent", never), other = ended("rendering", never),
              no_file = ended("simulation", never, "/no/such/deployment.yaml");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_TRUE(test::contains(unknown.said, "no node named 'absent'")) << unknown.said;
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_TRUE(test::contains(other.said, "node 'rendering' is a render_node, not a sim_node"))
      << other.said;
  EXPECT_EQ(no_file.exit_code, 2);
  EXPECT_TRUE(test::contains(no_file.said, "/no/such/deployment.yaml")) << no_file.said;
}

// Each case runs in its own process, because a stopped node cannot run again.
void run_until(const std::function<void()>& stop) {
  std::exit(run_sim_node("simulation", [&](NodeContext&) {
    if (!running()) std::exit(10);
    std::raise(SIGPIPE);  // a reader of the log that is gone
    if (!running()) std::exit(11);
    stop();
    if (running()) std::exit(12);
  }));
}

TEST(RunNodeDeathTest, StopsAtEachSignalAndOnRequest) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(run_until([] { std::raise(SIGTERM); }), testing::ExitedWithCode(0), "");
  EXPECT_EXIT(run_until([] { std::raise(SIGINT); }), testing::ExitedWithCode(0), "");
  EXPECT_EXIT(run_until(stop_running), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace fivepipe::node
