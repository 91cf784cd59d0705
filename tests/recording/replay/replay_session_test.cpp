// What a replay session selects, refuses and reports. tests/system/replay_test.cpp tests the
// process.
#include "common/recording/replay/replay_session.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "common/base/usage_error.h"
#include "common/recording/replay/node_inputs.h"
#include "common/recording/replay/recorded_deployment.h"
#include "tests/support/process.h"
#include "tests/support/recording/kept_recording.h"
#include "tests/support/recording/synthetic_recordings.h"
#include "tests/support/test_domain.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;
using End = ReplayResult::End;
namespace topics = bus::topics;
using test::kKeptRecording, test::kStart_ns;

std::set<std::string> topics_of(const recording::Recording& recording, const ReplayPlan& plan) {
  std::set<std::string> topics;
  for (const mcap::Id id : plan.channels) topics.insert(recording.channel(id)->topic);
  return topics;
}

template <class Callable>
std::string usage_error_of(Callable&& call) {
  try {
    call();
  } catch (const base::UsageError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ReplayRequest, ReplaysAllTopicsOnceAtTheRecordedRateByDefault) {
  const ReplayRequest request;
  EXPECT_EQ(request.topics, ".*");
  EXPECT_EQ(request.start_s, 0);
  EXPECT_FALSE(request.end_s);
  EXPECT_EQ(request.rate, 1);
  EXPECT_FALSE(request.lossless || request.loop || request.ignore_conflicts);
  EXPECT_EQ(request.frames_in_flight, 2);
  EXPECT_EQ(request.domain, 0u);
  EXPECT_EQ(request.wait_s, 20);
  const recording::Recording recording(kKeptRecording);
  const ReplayPlan plan = plan_for(recording, request);
  EXPECT_EQ(plan.start_ns, recording.start_ns());
  EXPECT_EQ(plan.end_ns, recording.end_ns());
  EXPECT_EQ(plan.rate, 1);
  EXPECT_FALSE(plan.lossless);
  EXPECT_EQ(plan.frames_in_flight, 2);
  EXPECT_EQ(plan.shape_cameras, 0u);
  EXPECT_EQ(plan.timeout, 5s);
  EXPECT_TRUE(plan.nodes.empty());
  std::set<std::string> all;
  for (const recording::RecordedChannel& channel : recording.channels()) all.insert(channel.topic);
  all.erase(topics::ReplaySession::name);
  EXPECT_EQ(topics_of(recording, plan), all);
}

TEST(ReplayPlan, SendsNodesTheInputsThatMatch) {
  const recording::Recording recording(kKeptRecording);
  ReplayRequest request;
  request.nodes = {"recon_a", "simulation"};
  request.rate = 0.5;
  request.lossless = true;
  request.frames_in_flight = 5;
  const ReplayPlan plan = plan_for(recording, request);
  ASSERT_EQ(plan.nodes.size(), 2u);
  EXPECT_EQ(plan.nodes[0].name, "recon_a");
  EXPECT_EQ(plan.nodes[0].program, "recon_node");
  EXPECT_EQ(plan.nodes[1].program, "sim_node");
  EXPECT_EQ(plan.shape_cameras, 3u);
  EXPECT_EQ(plan.rate, 0.5);
  EXPECT_TRUE(plan.lossless);
  EXPECT_EQ(plan.frames_in_flight, 5);
  EXPECT_EQ(plan.order, SendOrder::pipelined);
  std::set<std::string> inputs = inputs_of("recon_node", {});
  inputs.merge(inputs_of("sim_node", {}));
  for (const std::string& topic : topics_of(recording, plan)) EXPECT_TRUE(inputs.contains(topic));
  EXPECT_TRUE(topics_of(recording, plan).contains(topics::HeadPose::name));
  EXPECT_TRUE(topics_of(recording, plan).contains(topics::ObjectPixelMap::name));
  request.topics = "HeadPose|HullTile";
  EXPECT_EQ(topics_of(recording, plan_for(recording, request)),
            std::set<std::string>{topics::HeadPose::name});
  request.nodes = {"absent"};
  const std::string error = usage_error_of([&] { plan_for(recording, request); });
  EXPECT_EQ(error.find("the recording's deployment has no node 'absent'; its nodes are: "), 0u)
      << error;
  EXPECT_NE(error.find("recon_a, "), std::string::npos) << error;
}

class ReplaySessionTest : public testing::Test {
 protected:
  ReplaySessionTest() {
    recording::RecordingWriter writer(path_, "tests", {});
    const mcap::Id channel =
        writer.add_channel(topics::Command::name, topics::Command::type,
                           schema::fivepipe_schema(topics::Command::type), {{"writer", "w"}});
    std::vector<std::byte> command = test::cdr_header();
    test::append_value(command, std::uint32_t(4));
    test::append_value(command, std::uint32_t(0x00'6c'6c'61));  // "all"
    test::append_value(command, std::uint32_t(0));
    for (const std::int64_t at_ns : {0, 1'000'000, 2'000'000})
      writer.add(channel, kStart_ns + at_ns, kStart_ns, command);
  }
  ReplayRequest request() const {
    ReplayRequest request;
    request.domain = domain_;
    request.rate = 0;
    request.wait_s = std::nullopt;
    return request;
  }
  ReplayResult replayed(const ReplayRequest& request) {
    const recording::Recording recording(path_);
    return replay(recording, request,
                  {[this] { return control_; }, [this] { return interrupted_; },
                   [this](const ReplayCounts& counts) {
                     ++rounds_;
                     sent_ += counts.sent.contains(topics::Command::name)
                                  ? counts.sent.at(topics::Command::name)
                                  : 0;
                     if (rounds_ == rounds_until_stop_) control_ = ReplayControl::stop;
                   }});
  }

  const std::uint32_t domain_ = test::own_domain();
  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "made.mcap";
  ReplayControl control_ = ReplayControl::resume;
  bool interrupted_ = false;
  int rounds_ = 0, rounds_until_stop_ = 1000;
  std::uint64_t sent_ = 0;
};

TEST_F(ReplaySessionTest, SendsTheRangeIncludingItsEnds) {
  const recording::Recording recording(path_);
  const auto range = [&](double start_s, std::optional<double> end_s) {
    ReplayPlan plan;
    EXPECT_EQ(plan.start_ns, 0);
    EXPECT_EQ(plan.end_ns, 0);
    EXPECT_EQ(plan.rate, 1);
    EXPECT_EQ(plan.frames_in_flight, 2);
    EXPECT_EQ(plan.shape_cameras, 0u);
    EXPECT_FALSE(plan.lossless);
    set_range(plan, recording, start_s, end_s);
    return std::pair(plan.start_ns - kStart_ns, plan.end_ns - kStart_ns);
  };
  using Range = std::pair<std::int64_t, std::int64_t>;
  EXPECT_EQ(range(0, std::nullopt), Range(0, 2'000'000));
  EXPECT_EQ(range(0.002, std::nullopt), Range(2'000'000, 2'000'000));
  EXPECT_EQ(range(0.001, 0.001), Range(1'000'000, 1'000'000));
  EXPECT_EQ(range(0, 5), Range(0, 5'000'000'000));
  const std::string too_late =
      "nothing to replay: the recording lasts 0.002000 s; --start 0.003000 must be before its end "
      "and before --end";
  EXPECT_EQ(usage_error_of([&] { range(0.003, std::nullopt); }), too_late);
  EXPECT_EQ(usage_error_of([&] { range(0.003, 9); }), too_late);
  EXPECT_NE(usage_error_of([&] { range(0.001, 0.0005); }), "no error");
}

TEST_F(ReplaySessionTest, RefusesARecordingWithoutMatchingTopics) {
  ReplayRequest request = this->request();
  request.topics = "HeadPose";
  const ReplayResult result = replayed(request);
  EXPECT_EQ(result.end, End::refused);
  EXPECT_EQ(result.message, "nothing to replay: no topic of " + path_.string() +
                                " matches; `fivepipe info` lists its topics");
  EXPECT_EQ(rounds_, 0);
}

TEST_F(ReplaySessionTest, RefusesADomainWithOtherWritersUnlessForced) {
  bus::Bus other({.domain = domain_, .participant = "other"});
  const auto writer = other.writer<topics::Command>();
  ReplayRequest request = this->request();
  const ReplayResult refused = replayed(request);
  EXPECT_EQ(refused.end, End::refused);
  EXPECT_EQ(refused.message,
            "domain " + std::to_string(domain_) +
                " has other writers of the same topics:\n  'other' writes " +
                topics::Command::name +
                "\nNodes would mix their messages with the replay. Choose another --domain, or "
                "use --force");
  EXPECT_EQ(rounds_, 0);
  request.ignore_conflicts = true;
  EXPECT_EQ(replayed(request).end, End::complete);
  EXPECT_EQ(rounds_, 1);
  EXPECT_EQ(sent_, 3u);
}

TEST_F(ReplaySessionTest, RefusesADomainWithNodesOfAnotherDeployment) {
  bus::Bus node({.domain = domain_, .participant = "node", .deployment = "lab"});
  auto commands = node.reader<topics::Command>();
  ReplayRequest request = this->request();
  const std::string refusal = "the nodes in domain " + std::to_string(domain_) +
                              " belong to deployment 'lab' and accept only messages of it; this "
                              "replay is of ";
  ReplayResult result = replayed(request);
  EXPECT_EQ(result.end, End::refused);
  EXPECT_EQ(result.message, refusal +
                                "no deployment. Add --deployment and the file of 'lab', or "
                                "choose another --domain");
  request.deployment = "demo";
  EXPECT_EQ(replayed(request).message.substr(0, refusal.size() + 17),
            refusal + "deployment 'demo'");
  request.deployment = "lab";
  result = replayed(request);
  EXPECT_EQ(result.end, End::complete) << result.message;
  int received = 0;
  EXPECT_TRUE(test::eventually(node, 10s, [&] {
    for (const auto& command : commands.take()) received += command.valid();
    return received == 3;
  })) << received;
}

TEST_F(ReplaySessionTest, NamesTheMissingReader) {
  ReplayRequest request = this->request();
  request.wait_s = 0.05;
  const ReplayResult result = replayed(request);
  EXPECT_EQ(result.end, End::no_reader);
  EXPECT_EQ(result.message, "no reader: no node reads any of the topics (domain " +
                                std::to_string(domain_) +
                                "); wait longer with --wait S, or use --no-wait");
  interrupted_ = true;
  request.wait_s = 3600;
  EXPECT_EQ(replayed(request).end, End::stopped);
  EXPECT_EQ(rounds_, 0);
}

TEST_F(ReplaySessionTest, WaitsForAReaderAndLoopsUntilStopped) {
  bus::Bus node({.domain = domain_, .participant = "node"});
  const auto reader = node.reader<topics::Command>();
  ReplayRequest request = this->request();
  request.wait_s = 60;
  request.loop = true;
  rounds_until_stop_ = 2;
  const ReplayResult result = replayed(request);
  EXPECT_EQ(result.end, End::complete);
  EXPECT_EQ(result.message, "");
  EXPECT_EQ(rounds_, 2);
  EXPECT_EQ(sent_, 6u);
}

// A lossless replay that lost a chunk is not repeated: each round would lose it again.
TEST_F(ReplaySessionTest, ALosslessReplayLoopsWhileItIsComplete) {
  bus::Bus node({.domain = domain_, .participant = "node"});
  const auto reader = node.reader<topics::Command>();
  ReplayRequest request = this->request();
  request.wait_s = 60;
  request.lossless = request.loop = true;
  rounds_until_stop_ = 2;
  EXPECT_EQ(replayed(request).end, End::complete);
  EXPECT_EQ(rounds_, 2);
  std::vector<std::byte> bytes = test::file_bytes(path_);
  const mcap::ChunkIndex chunk = mcap::Reader(path_).chunks().at(0);
  bytes[chunk.offset + chunk.length_bytes / 2] ^= std::byte(1);
  test::write_file(path_, bytes);
  rounds_ = 0;
  control_ = ReplayControl::resume;
  EXPECT_EQ(replayed(request).end, End::incomplete);
  EXPECT_EQ(rounds_, 1);
}

// A later version may have topics that this build does not know.
TEST_F(ReplaySessionTest, TopicsThatThisBuildDoesNotKnowAreSkipped) {
  {
    recording::RecordingWriter writer(path_, "tests", {});
    const std::string schema = schema::fivepipe_schema(topics::Command::type);
    const std::vector<std::byte> command = test::cdr_header();
    writer.add(writer.add_channel("fivepipe/v9/Command", topics::Command::type, schema, {}),
               kStart_ns, kStart_ns, command);
  }
  const recording::Recording recording(path_);
  const ReplayPlan plan = plan_for(recording, request());
  EXPECT_EQ(plan.channels.size(), 1u);
  bus::Bus bus({domain_});
  Replayer replayer(bus, recording, plan);
  EXPECT_EQ(replayer.conflicts(), std::vector<std::string>());
  replayer.run([] { return ReplayControl::resume; });
  EXPECT_TRUE(replayer.counts().in_file.empty());
  EXPECT_TRUE(replayer.counts().complete());
}

TEST_F(ReplaySessionTest, AnInterruptStopsItBeforeTheFirstMessage) {
  interrupted_ = true;
  EXPECT_EQ(replayed(request()).end, End::stopped);
  EXPECT_EQ(rounds_, 1);
  EXPECT_EQ(sent_, 0u);
}

// Otherwise every replay to nodes would leave a folder in the temporary directory.
TEST(RecordedDeployment, LoadsTheSettingsAndRemovesItsFolder) {
  const recording::Recording recording(kKeptRecording);
  std::filesystem::path folder;
  {
    const RecordedDeployment recorded(recording, {});
    folder = recorded.file().parent_path();
    EXPECT_TRUE(std::filesystem::exists(recorded.file()));
    EXPECT_FALSE(recorded.deployment().nodes.empty());
    EXPECT_EQ(recorded.settings(), recording.metadata("settings"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder)) << folder;
  const test::TestFolder other;
  recording::RecordingWriter(other.path / "none.mcap", "tests", {}).finish();
  const recording::Recording none(other.path / "none.mcap");
  try {
    RecordedDeployment(none, {});
    FAIL();
  } catch (const recording::RecordingError& error) {
    EXPECT_EQ(error.what(), none.file().string() +
                                " contains no deployment; record with --deployment FILE or with "
                                "`fivepipe up --record`");
  }
}

TEST(RecordedDeployment, LeavesNoFolderIfItCannotBeLoaded) {
  const test::TestFolder folder;
  recording::RecordingWriter(folder.path / "none.mcap", "tests", {}).finish();
  const recording::Recording none(folder.path / "none.mcap"), kept_one(kKeptRecording);
  const std::filesystem::path temporary = folder.path / "temporary";
  std::filesystem::create_directory(temporary);
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  setenv("TMPDIR", temporary.c_str(), 1);
  EXPECT_THROW(RecordedDeployment(none, {}), recording::RecordingError);
  EXPECT_THROW(RecordedDeployment(kept_one, {{"changed", "value"}}), config::ConfigError)
      << "the deployment has no such setting";
  before ? setenv("TMPDIR", kept.c_str(), 1) : unsetenv("TMPDIR");
  EXPECT_TRUE(std::filesystem::is_empty(temporary));
}

}  // namespace
}  // namespace fivepipe::replay
