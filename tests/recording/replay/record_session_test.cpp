// A recording session as a library. tests/system/recording_test.cpp tests the process.
#include "common/recording/replay/record_session.h"

#include <gtest/gtest.h>

#include <optional>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/recording/replay/recorder.h"
#include "tests/support/process.h"
#include "tests/support/recording/synthetic_recordings.h"
#include "tests/support/test_domain.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;
namespace topics = bus::topics;

std::set<std::string> names(const std::vector<topics::Topic>& chosen) {
  std::set<std::string> names;
  for (const topics::Topic& topic : chosen) names.insert(topic.name);
  return names;
}

TEST(TopicsToRecord, AreThoseThatMatchWithoutSessionsAndOnRequestWithoutImages) {
  std::set<std::string> expected = names({topics::all().begin(), topics::all().end()});
  expected.erase(topics::ReplaySession::name);
  expected.erase(topics::HostStatus::name);
  EXPECT_EQ(names(topics_to_record(".*", true)), expected);
  expected.erase(topics::ObjectColour::name);
  expected.erase(topics::HullTile::name);
  EXPECT_EQ(names(topics_to_record(".*", false)), expected);
  EXPECT_EQ(names(topics_to_record("HeadPose|HullTile", true)),
            (std::set<std::string>{topics::HeadPose::name, topics::HullTile::name}));
  EXPECT_EQ(names(topics_to_record("ReplaySession", false)),
            std::set<std::string>{topics::ReplaySession::name});
  EXPECT_EQ(names(topics_to_record(".*|HostStatus", true)).count(topics::HostStatus::name), 1u);
  EXPECT_TRUE(topics_to_record("NoSuchTopic", true).empty());
}

TEST(RecordResult, IsCompleteIfTheFileHasAllMessagesAndAtLeastOne) {
  RecordResult result;
  EXPECT_FALSE(result.complete());
  EXPECT_FALSE(result.finished || result.synced);
  EXPECT_EQ(result.bytes_written, 0u);
  EXPECT_EQ(result.elapsed_s, 0);
  result.counts["empty"];
  EXPECT_FALSE(result.complete());
  result.counts["topic"].received = 1;
  EXPECT_TRUE(result.complete());
  RecordResult lossy = result, missing = result, failed = result;
  lossy.counts["topic"].lost = 1;
  EXPECT_FALSE(lossy.complete());
  missing.counts["empty"].missing = 1;
  EXPECT_FALSE(missing.complete());
  failed.failure = "the disk is full";
  EXPECT_FALSE(failed.complete());
}

class RecordSessionTest : public testing::Test {
 protected:
  RecordRequest request(double duration_s) const {
    RecordRequest request;
    request.file = path_;
    request.topics = {topics::described<topics::FrameComposited>(),
                      topics::described<topics::NodeStatus>()};
    request.domain = domain_;
    request.name = "the recorder";
    request.duration_s = duration_s;
    return request;
  }
  void send() {
    fivepipe_v1_FrameComposited message{};
    messages::set_text(message.viewer, "viewer");
    writer_.write(message);
    ++sent_;
  }
  // As a node that started at start_ns and has sent so many messages.
  void send_status(std::int64_t start_ns, std::uint64_t sent) {
    fivepipe_v1_TopicCounts topic{};
    messages::set_text(topic.topic, topics::FrameComposited::name);
    topic.sent = sent;
    std::vector<fivepipe_v1_TopicCounts> all{topic};
    fivepipe_v1_NodeStatus status{};
    messages::set_text(status.node, "peer");
    status.start_stamp_ns = start_ns;
    messages::borrow(status.topics, all);
    statuses_.write(status);
  }
  // Number of messages of the topic in the file.
  std::uint64_t recorded() const {
    const recording::Recording recording(path_);
    EXPECT_TRUE(recording.mcap().is_finished());
    std::uint64_t messages = 0;
    for (const recording::RecordedChannel& channel : recording.channels())
      if (channel.topic == topics::FrameComposited::name && !channel.key_states)
        messages += channel.messages;
    return messages;
  }

  const std::uint32_t domain_ = test::own_domain();
  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "made.mcap";
  bus::Bus peer_{{.domain = domain_, .participant = "peer"}};
  bus::Writer<topics::FrameComposited> writer_ = peer_.writer<topics::FrameComposited>();
  bus::Writer<topics::NodeStatus> statuses_ = peer_.writer<topics::NodeStatus>();
  std::uint64_t sent_ = 0;
};

// The first signal ends the recording.
TEST_F(RecordSessionTest, MessagesInTransitAtASignalAreRecorded) {
  auto statuses = peer_.reader<topics::NodeStatus>();
  int calls_after = 0;
  const RecordResult result = record(request(0), [&] {
    if (writer_.readers() == 0) return 0;
    if (sent_ < 3) {
      send();
      return 0;
    }
    if (++calls_after == 2) send();
    return 1;
  });
  EXPECT_EQ(sent_, 4u);
  const recording::TopicCounts counts = result.counts.at(topics::FrameComposited::name);
  EXPECT_EQ(counts.received, 4u);
  EXPECT_EQ(counts.written, 4u);
  EXPECT_EQ(counts.lost, 0u);
  EXPECT_EQ(recorded(), 4u);
  EXPECT_EQ(result.bytes_written, std::filesystem::file_size(path_));
  EXPECT_GE(result.elapsed_s, 0.2);
  EXPECT_LT(result.elapsed_s, 120);
  EXPECT_EQ(result.loss_reason, "");
  EXPECT_EQ(result.failure, "");
  EXPECT_TRUE(result.finished);
  EXPECT_TRUE(result.synced);
  EXPECT_TRUE(result.complete());
  // No node reported how many messages it sent.
  EXPECT_TRUE(result.sent.empty());
  EXPECT_EQ(result.unverified_nodes, std::set<std::string>{"peer"});
  const recording::Recording recording(path_);
  EXPECT_EQ(recording.metadata("recording").at("domain"), std::to_string(domain_));
  EXPECT_EQ(recording.mcap().header().library.substr(0, 9), "fivepipe ");
  // The recorder does not record its own statuses.
  for (const recording::RecordedChannel& channel : recording.channels()) {
    EXPECT_EQ(channel.topic, topics::FrameComposited::name);
    EXPECT_EQ(channel.node, "peer");
    EXPECT_EQ(channel.writer.size(), 32u);
    EXPECT_EQ(channel.metadata.at("participant").size(), 32u);
    EXPECT_EQ(channel.metadata.at("delivery"), "event");
    EXPECT_TRUE(channel.metadata.contains("qos.history"));
  }
  // The recorder's own last status states the totals.
  bool is_reported = false;
  EXPECT_TRUE(test::eventually(peer_, 10s, [&] {
    for (const auto& sample : statuses.take()) {
      if (!sample.valid() || std::string(sample->node) != "the recorder") continue;
      for (const fivepipe_v1_TopicCounts& topic : messages::span_of(sample->topics))
        is_reported |= std::string(topic.topic) == topics::FrameComposited::name &&
                       topic.received == 4 && topic.recorded == 4 && topic.lost == 0;
    }
    return is_reported;
  }));
}

TEST_F(RecordSessionTest, EndsAtItsDuration) {
  RecordRequest request = this->request(0.1);
  request.writer.sync = false;
  const RecordResult result = record(request, [] { return 0; });
  EXPECT_GE(result.elapsed_s, 0.3) << "with the time for messages in transit";
  EXPECT_FALSE(result.complete()) << "no message";
  EXPECT_TRUE(result.finished);
  EXPECT_TRUE(result.synced) << "not requested";
}

// A status that counts a message may arrive before it.
TEST_F(RecordSessionTest, WaitsAtTheEndForMessagesThatNodesHaveSent) {
  using Clock = std::chrono::steady_clock;
  std::int64_t start_ns = 0;  // of the node, after that of the recorder
  std::optional<Clock::time_point> matched, signalled;
  const RecordResult result = record(request(0), [&] {
    if (start_ns == 0) start_ns = base::now_realtime_ns();
    if (writer_.readers() == 0 || statuses_.readers() == 0) return 0;
    if (!matched) matched = Clock::now();
    if (sent_ < 2) send();
    send_status(start_ns, 3);
    // The recorder lists the participants twice per second.
    if (Clock::now() - *matched < 700ms) return 0;
    if (!signalled) signalled = Clock::now();
    if (sent_ < 3 && Clock::now() - *signalled > 300ms) send();
    return 1;
  });
  ASSERT_EQ(result.sent.size(), 1u);
  EXPECT_EQ(result.sent[0].sent, 3u);
  EXPECT_EQ(result.sent[0].received, 3u);
  EXPECT_TRUE(result.complete());
  EXPECT_EQ(recorded(), 3u);
}

TEST_F(RecordSessionTest, ComparesTheSentCountsOfNodes) {
  using Clock = std::chrono::steady_clock;
  std::int64_t start_ns = 0;  // of the node, after that of the recorder
  std::optional<Clock::time_point> matched;
  const RecordResult result = record(request(0), [&] {
    if (start_ns == 0) start_ns = base::now_realtime_ns();
    if (writer_.readers() == 0 || statuses_.readers() == 0) return 0;
    if (!matched) matched = Clock::now();
    if (sent_ < 2) send();
    send_status(start_ns, 5);
    // The recorder lists the participants twice per second.
    return Clock::now() - *matched > 700ms ? 1 : 0;
  });
  ASSERT_EQ(sent_, 2u);
  EXPECT_EQ(recorded(), 2u);
  ASSERT_EQ(result.sent.size(), 1u);
  EXPECT_EQ(result.sent[0].node, "peer");
  EXPECT_EQ(result.sent[0].sent, 5u);
  EXPECT_EQ(result.sent[0].received, 2u);
  EXPECT_EQ(result.counts.at(topics::FrameComposited::name).sent, 5u);
  EXPECT_EQ(result.counts.at(topics::FrameComposited::name).missing, 3u);
  EXPECT_TRUE(result.unverified_nodes.empty());
  EXPECT_FALSE(result.complete());
}

TEST(RefusalToOverwrite, NamesTheFileAndTheOption) {
  const test::TestFolder folder;
  const std::filesystem::path file = folder.path / "a.mcap";
  EXPECT_EQ(refusal_to_overwrite(file), "");
  test::write_file(file, {});
  EXPECT_EQ(refusal_to_overwrite(file), file.string() + " exists; use --force to overwrite it");
}

// The files of a deployment may be in any folders.
TEST(RecordHeader, AttachesFilesByTheirPathBelowTheFolderOfAll) {
  const test::TestFolder folder;
  const std::filesystem::path mcap = folder.path / "a.mcap";
  config::Deployment deployment;
  deployment.name = "made up";
  deployment.file = folder.path / "x" / "deep" / "deployment.yaml";
  deployment.files = {deployment.file, folder.path / "x" / "objects" / "cube.obj"};
  for (const std::filesystem::path& file : deployment.files) {
    std::filesystem::create_directories(file.parent_path());
    const std::string content = file.filename();
    test::write_file(file, std::as_bytes(std::span(content)));
  }
  {
    recording::RecordingWriter writer(mcap, "tests", {});
    write_header(writer, &deployment, {{"key", "value"}}, 7);
  }
  const recording::Recording recording(mcap);
  const auto header = recording.metadata("recording");
  EXPECT_EQ(header.at("domain"), "7");
  EXPECT_EQ(header.at("deployment"), "made up");
  EXPECT_EQ(header.at("deployment_file"), "deep/deployment.yaml");
  EXPECT_EQ(recording.metadata("settings"), (std::map<std::string, std::string>{{"key", "value"}}));
  const auto& attachments = recording.mcap().attachments();
  ASSERT_EQ(attachments.size(), 2u);
  EXPECT_EQ(attachments[0].name, "deployment/deep/deployment.yaml");
  EXPECT_EQ(attachments[0].media_type, "application/yaml");
  EXPECT_EQ(attachments[1].name, "deployment/objects/cube.obj");
  EXPECT_EQ(attachments[1].media_type, "application/octet-stream");
  EXPECT_EQ(attachments[1].log_stamp_ns, attachments[1].create_stamp_ns);
  EXPECT_GT(attachments[1].log_stamp_ns, 1'700'000'000'000'000'000u);
  EXPECT_EQ(recording.mcap().read(attachments[1]).content, "cube.obj");
  deployment.files.push_back(folder.path / "missing");
  recording::RecordingWriter writer(folder.path / "b.mcap", "tests", {});
  try {
    write_header(writer, &deployment, {}, 7);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), (folder.path / "missing").string() + " cannot be read");
  }
}

}  // namespace
}  // namespace fivepipe::replay
