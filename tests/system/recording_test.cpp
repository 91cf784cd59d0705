// A recording of real processes has all their messages, and its replay gives the same recording.
#include <gtest/gtest.h>
#include <signal.h>

#include "common/config/deployment.h"
#include "common/recording/mcap/recover.h"
#include "common/recording/replay/node_inputs.h"
#include "tests/support/recording/replayed_nodes.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using recording::Recording;
using test::eventually;
using test::kSmallDeployment;

constexpr std::uint64_t kCameras = 3, kTiles = 48;  // of the small deployment

class RecordingPipeline : public test::ReplayedNodesTest {};

TEST_F(RecordingPipeline, ContainsAllMessagesAndDeployment) {
  const recording::Recording recording(recorded(1));
  EXPECT_TRUE(recording.mcap().is_finished()) << recording.mcap().damage().summary;
  const auto counts = recording.metadata("counts");
  std::map<std::string, std::uint64_t> in_file = test::counts_by_topic(recording);
  for (const auto& [topic, count] : in_file) {
    EXPECT_EQ(counts.at(topic + " received"), std::to_string(count)) << topic;
    EXPECT_EQ(counts.at(topic + " written"), std::to_string(count)) << topic;
    EXPECT_EQ(counts.at(topic + " lost"), "0") << topic;
  }
  const auto statuses = test::final_statuses(recording);
  EXPECT_EQ(statuses.size(), 5u);
  auto sent = test::sent_by_topic(statuses);
  for (const auto& [topic, count] : sent) EXPECT_EQ(in_file[topic], count) << topic;
  for (const char* topic : {bus::topics::CameraInfo::name, bus::topics::ObjectPixelMap::name,
                            bus::topics::HullTile::name, bus::topics::VirtualState::name,
                            bus::topics::FrameComposited::name})
    EXPECT_GT(sent[topic], 0u) << topic;
  const auto deployment = recording.extract_deployment(folder_ / "extracted");
  ASSERT_TRUE(deployment);
  EXPECT_EQ(config::load_deployment(*deployment).nodes.size(), 5u);
  EXPECT_EQ(test::text_of(*deployment), test::text_of(kSmallDeployment));
}

TEST_F(RecordingPipeline, ReplayAndRerecordIsIdentical) {
  const auto first = recorded(1), second = folder_ / "again.mcap";
  const auto recorder = this->recorder(second);
  const auto replay = fivepipe("replay", {"replay", first.string(), "--lossless", "--rate", "max"});
  ASSERT_EQ(replay->wait_for_end(30s), 0) << replay->said();
  recorder->signal(SIGTERM);
  ASSERT_EQ(recorder->wait_for_end(10s), 0) << recorder->said();
  const recording::Recording was(first), is(second);
  EXPECT_EQ(test::counts_by_topic(was), test::counts_by_topic(is));
  const auto expected = test::messages_by_writer(was), found = test::messages_by_writer(is);
  for (const auto& [topic, writers] : expected) {
    ASSERT_TRUE(found.contains(topic)) << topic;
    EXPECT_TRUE(found.at(topic) == writers)
        << topic << ": " << found.at(topic).size() << " writers, " << writers.size() << " expected";
  }
  // At the end of a replay, no key has a writer, even if it had one at the end of the recording.
  const auto changes = test::last_key_changes(is);
  for (const auto& [key, change] : test::last_key_changes(was)) {
    ASSERT_TRUE(changes.contains(key)) << key.first;
    EXPECT_EQ(changes.at(key), change) << key.first;
  }
}

// If the recorder is killed, the file has all messages up to the last closed chunk, which is at
// most 0.5 s old.
TEST_F(RecordingPipeline, RecordingOfKilledRecorderIsRepaired) {
  const auto file = folder_ / "killed.mcap";
  const auto recorder = this->recorder(file, {"--deployment", kSmallDeployment});
  bus::Bus member({.domain = domain_, .deployment = "small"});
  auto commands = member.writer<bus::topics::Command>();
  ASSERT_TRUE(eventually(bus_, 10s, [&] { return commands.readers() == 1; }));
  std::uint64_t sent = 0;
  // Waits until the first chunk is on the disk.
  ASSERT_TRUE(eventually(bus_, 20s, [&] {
    fivepipe_v1_Command message{};
    message.kind = fivepipe_v1_resume_simulation;
    commands.write(message);
    ++sent;
    return recording::Recording(file).mcap().statistics().messages > 0;
  }));
  recorder->signal(SIGKILL);
  EXPECT_EQ(recorder->wait_for_end(5s), 128 + SIGKILL);
  const recording::Recording unfinished(file);
  EXPECT_FALSE(unfinished.mcap().is_finished());
  const auto expected = test::messages_by_writer(unfinished);
  const std::uint64_t kept = test::counts_by_topic(unfinished).at(bus::topics::Command::name);
  EXPECT_GT(kept, 0u);
  EXPECT_LE(kept, sent);
  EXPECT_EQ(expected.at(bus::topics::Command::name).at(0).size(), kept);
  ASSERT_TRUE(unfinished.extract_deployment(folder_ / "extracted"));
  EXPECT_FALSE(mcap::recover(file).was_finished);
  const recording::Recording repaired(file);
  EXPECT_TRUE(repaired.mcap().is_finished());
  EXPECT_TRUE(test::messages_by_writer(repaired) == expected);
}

// A replay sends to a node exactly the topics that the node reads.
TEST_F(RecordingPipeline, NodeInputsMatchSubscriptions) {
  const test::NodeUnderTest nodes[] = {{"capture_node", "capture"},
                                       {"recon_node", "recon_a"},
                                       {"sim_node", "simulation"},
                                       {"render_node", "rendering"}};
  const std::string coverage =
      test::changed_deployment(folder_ / "coverage", "program: render_node}",
                               "program: render_node}\nhull: {coverage: true}");
  const auto expect_inputs = [&](const test::NodeUnderTest& under_test,
                                 const std::string& deployment) {
    const auto program = node(under_test.program, under_test.name, deployment);
    std::set<std::string> reads, expected = replay::inputs_of(under_test.program, {});
    if (deployment == coverage &&
        (under_test.program == "recon_node" || under_test.program == "sim_node"))
      expected.insert(bus::topics::ObjectCoverage::name);
    EXPECT_TRUE(eventually(bus_, test::kStart,
                           [&] {
                             reads.clear();
                             for (const bus::EndpointDescription& endpoint : bus_.endpoints())
                               if (endpoint.participant == under_test.name && !endpoint.writes)
                                 reads.insert(endpoint.topic);
                             return reads == expected;
                           }))
        << under_test.name << " reads " << testing::PrintToString(reads) << '\n'
        << program->said();
  };
  for (const test::NodeUnderTest& under_test : nodes)
    for (const std::string& deployment : {test::kSmallDeployment, coverage})
      expect_inputs(under_test, deployment);
}

// In a lossless replay, a node handles every complete frame and drops nothing else. The first
// frames may lack tiles, because one recon_node may read before the other, and the last ones tiles
// or the state, because `up` stops all nodes at once. One process writes all maps of a frame.
TEST_F(RecordingPipeline, EachNodeAloneHandlesEveryFrame) {
  // The encoder of a video drops frames on a busy machine.
  const std::string deployment = test::changed_deployment(
      folder_ / "files", "program: render_node}", "program: render_node, video: false}");
  const auto file = recorded(0.5, deployment);
  const recording::Recording recording(file);
  const auto expect_all_handled = [&](const test::NodeUnderTest& node, const std::string& input,
                                      std::uint64_t per_frame, const char* counted,
                                      const std::string& output) {
    std::uint64_t complete = 0, rest = 0, rest_before_the_last_complete = 0, rest_at_the_start = 0,
                  without_state = 0;
    const auto states = test::counts_by_frame(recording, bus::topics::VirtualState::name);
    for (const auto& [frame, count] : test::counts_by_frame(recording, input)) {
      if (count == per_frame && !states.contains(frame)) ++without_state;
      EXPECT_LE(count, per_frame) << input << " of frame " << frame;
      ++(count == per_frame ? complete : rest);
      if (complete == 0) rest_at_the_start = rest;
      if (count == per_frame) rest_before_the_last_complete = rest;
    }
    EXPECT_EQ(rest_before_the_last_complete, rest_at_the_start)
        << input << ": frames between complete ones are incomplete";
    if (input == bus::topics::ObjectPixelMap::name) {
      EXPECT_EQ(rest, 0u);
    }
    EXPECT_GT(complete, 0u);
    const auto run = replayed(file, {node}, {output}, {"--rate", "max"}, deployment);
    EXPECT_EQ(run.counts.at(node.name).at(counted), complete) << node.name << '\n' << run.said;
    if (run.drops.contains(node.name))
      for (const auto& [drop, count] : run.drops.at(node.name)) {
        const bool is_state = node.name == "rendering" && drop == "late_state";
        EXPECT_TRUE(is_state || drop == "incomplete_hull") << drop << " of " << node.name;
        EXPECT_LE(count, is_state ? without_state : rest) << drop << " of " << node.name;
      }
    EXPECT_NE(run.said.find("\n" + node.name + " "), std::string::npos) << run.said;
  };
  for (const auto& [node, output] :
       {std::pair{test::NodeUnderTest{"recon_node", "recon_a"}, bus::topics::HullTile::name},
        std::pair{test::NodeUnderTest{"sim_node", "simulation"}, bus::topics::VirtualState::name}})
    expect_all_handled(node, bus::topics::ObjectPixelMap::name, kCameras, "frame_sets_complete",
                       output);
  expect_all_handled({"render_node", "rendering"}, bus::topics::HullTile::name, kTiles,
                     "frames_composited", bus::topics::FrameComposited::name);
}

}  // namespace
}  // namespace fivepipe::test
