#include "tests/launch/cli/recording_commands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/support/test_domain.h"
#include "tests/support/text.h"

namespace fivepipe::launch {
namespace {

TEST_F(RecordingCommands, LsListsTopicsOrNodesOfAFile) {
  const Answer topics = fivepipe("ls " + session.string());
  EXPECT_EQ(topics.exit_code, 0) << topics.text;
  EXPECT_TRUE(holds(topics, kCompositedTopic) && holds(topics, "reliable, last 64") &&
              holds(topics, "render") && holds(topics, "96"))
      << topics.text;
  EXPECT_FALSE(holds(topics, "key_state")) << topics.text;
  EXPECT_LE(longest_line(topics.text), 120u);
  const Answer nodes = fivepipe("ls --nodes " + session.string());
  EXPECT_EQ(nodes.text, "node     writes\ncapture  HeadPose\nrender   FrameComposited\n");
  EXPECT_EQ(fivepipe("ls --domain 3 " + session.string()).exit_code, 2);
}

TEST_F(RecordingCommands, EchoShowsMessagesOfAFile) {
  const std::string from = " --from " + session.string();
  const Answer first = fivepipe("echo FrameComposited --count 1" + from);
  EXPECT_EQ(first.exit_code, 0);
  EXPECT_EQ(first.text,
            "---  # 22:13:20.000000 render, latency 2.00 ms\n"
            "viewer: viewer\nframe: 0\ncapture_stamp_ns: 1700000000000000000\ncomposited_stamp_ns: "
            "1700000000020000000\n");
  // The first log stamp is at 2 ms: frames 50 and 51 are received 0.5 and 0.51 s after it.
  EXPECT_EQ(fivepipe("echo composited --field frame --start 0.5 --end 0.51" + from).text,
            "--- 50  # 22:13:20.500000 render, latency 2.00 ms\n--- 51  # 22:13:20.510000 render, "
            "latency 2.00 ms\n");
  const Answer last = fivepipe("echo FrameComposited --json --start 0.99" + from + " | tail -n 1");
  const auto line = nlohmann::json::parse(last.text);
  EXPECT_EQ(line["key_change"], "unregistered");
  EXPECT_EQ(line["key"]["viewer"], "viewer");
}

TEST_F(RecordingCommands, EchoPrintsExactValuesWithoutTimes) {
  const std::string from = " --from " + session.string();
  const Answer head = fivepipe("echo HeadPose --json --full --hex --bare" + from);
  EXPECT_EQ(head.exit_code, 0) << head.text;
  EXPECT_TRUE(head.text.starts_with("{\"viewer\":\"\",\"frame\":0,") && holds(head, "\"0x0p+0\""))
      << head.text;
  EXPECT_FALSE(holds(head, "log_stamp_ns") || holds(head, "\"writer\"")) << head.text;
  const Answer frames = fivepipe("echo FrameComposited --field frame --bare --start 0.99" + from);
  EXPECT_EQ(frames.text, "--- 99\n") << "the key change after it is not printed";
}

TEST_F(RecordingCommands, CompareFindsOneDifferentValue) {
  const fs::path other = folder.path / "other.mcap";
  write_session(other, {.compression = mcap::Compression::none, .chunk_bytes = 5000});
  const std::string compare =
      FIVEPIPE_SOURCE_DIR "/tests/recordings/compare " FIVEPIPE_BINARY_DIR " ";
  const std::string topics = " FrameComposited HeadPose 2>&1";
  const Answer equal = shell(compare + session.string() + " " + other.string() + topics);
  EXPECT_EQ(equal.exit_code, 0) << equal.text;
  EXPECT_TRUE(holds(equal, "FrameComposited: 96 and 96 messages, equal")) << equal.text;
  write_session(other, {}, schema::fivepipe_schema(kCompositedType), 1);
  const Answer different = shell(compare + session.string() + " " + other.string() + topics);
  EXPECT_EQ(different.exit_code, 1) << different.text;
  EXPECT_TRUE(holds(different, "FrameComposited: 96 and 96 messages, DIFFERENT")) << different.text;
  EXPECT_TRUE(holds(different, "HeadPose: 1 and 1 messages, equal")) << different.text;
}

TEST_F(RecordingCommands, EchoRejectsUnknownTopicsAndListsKnownOnes) {
  const std::string from = " --from " + session.string();
  const Answer ambiguous = fivepipe("echo e" + from);
  EXPECT_EQ(ambiguous.exit_code, 2);
  EXPECT_TRUE(holds(ambiguous, kCompositedTopic) && holds(ambiguous, kHeadTopic)) << ambiguous.text;
  const Answer field = fivepipe("echo FrameComposited --field frames" + from);
  EXPECT_EQ(field.exit_code, 2);
  EXPECT_TRUE(holds(field, "viewer, frame, capture_stamp_ns")) << field.text;
  EXPECT_EQ(fivepipe("echo FrameComposited --field 'a['" + from).exit_code, 2);
  EXPECT_EQ(fivepipe("echo FrameComposited --start 1").exit_code, 2);
  const Answer none = fivepipe("echo HeadPose --start 0.9" + from);
  EXPECT_EQ(none.exit_code, 0);
  EXPECT_TRUE(holds(none, "no message in this time range")) << none.text;
}

TEST_F(RecordingCommands, EchoStatesThatATopicHasNoMessage) {
  {
    recording::RecordingWriter writer(session, "test", {});
    const auto channel =
        writer.add_channel(kCompositedTopic, kCompositedType,
                           schema::fivepipe_schema(kCompositedType), {{"node", "render"}});
    writer.add(channel, start_ns, start_ns, frame_cdr("viewer", 1));
    writer.add(channel, start_ns + ms, start_ns, recording::KeyChange::disposed, key_cdr("viewer"));
    writer.finish();
  }
  const std::string bare = "echo FrameComposited --bare --from " + session.string();
  EXPECT_EQ(fivepipe(bare + " --field frame").text, "--- 1\n");
  EXPECT_EQ(fivepipe(bare + " --start 0.0005").text,
            kCompositedTopic + ": no message in this time range\n");
}

TEST_F(RecordingCommands, EchoExitsOnClosedPipe) {
  for (const std::string options : {"", "--json "}) {
    const std::string echo =
        program + "echo FrameComposited " + options + "--from " + session.string();
    const Answer head = shell("bash -c 'set -o pipefail; " + echo + " 2>&1 | head -n 1'");
    EXPECT_EQ(head.exit_code, 0) << head.text;
    EXPECT_EQ(std::count(head.text.begin(), head.text.end(), '\n'), 1) << head.text;
  }
}

TEST_F(RecordingCommands, AFullDiskIsAnError) {
  for (const std::string command :
       {"echo FrameComposited --from ", "hz FrameComposited --from ", "ls ", "info "}) {
    const Answer answer = shell(program + command + session.string() + " 2>&1 >/dev/full");
    EXPECT_EQ(answer.exit_code, 1) << command;
    EXPECT_TRUE(holds(answer, "standard output")) << command << answer.text;
  }
}

TEST_F(RecordingCommands, HzFindsRateAndMissingFrames) {
  const Answer answer = fivepipe("hz FrameComposited --from " + session.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(holds(answer, "96 frames, 4 missing between them: 17, 40..42")) << answer.text;
  // 95 intervals in 990 ms.
  EXPECT_TRUE(holds(answer, "render") && holds(answer, "95.96") && holds(answer, "10.00") &&
              holds(answer, "40.00") && holds(answer, "2.00"))
      << answer.text;
  EXPECT_LE(longest_line(answer.text), 120u);
}

// A recording holds the stamps that any process sent. Their differences must not overflow.
TEST_F(RecordingCommands, ExtremeStampsAreShown) {
  const fs::path file = folder.path / "extreme.mcap";
  {
    recording::RecordingWriter writer(file, "test", {});
    const auto channel =
        writer.add_channel(kCompositedTopic, kCompositedType,
                           schema::fivepipe_schema(kCompositedType), {{"node", "render"}});
    std::uint64_t frame = 0;
    for (const std::int64_t log_ns : {std::int64_t(0), start_ns, INT64_MAX, INT64_MIN})
      for (const std::int64_t source_ns : {INT64_MIN, start_ns, INT64_MAX})
        writer.add(channel, log_ns, source_ns, frame_cdr("viewer", ++frame));
  }
  for (const std::string command :
       {"info ", "hz FrameComposited --from ", "echo FrameComposited --from ",
        "echo FrameComposited --start 1e300 --from ", "echo FrameComposited --end 1e300 --from "}) {
    const Answer answer = fivepipe(command + file.string());
    EXPECT_GE(answer.exit_code, 0) << command << answer.text;
    EXPECT_FALSE(holds(answer, "runtime error")) << command << answer.text;
  }
  // The first message's latency is 2^63 ns, which would wrap to a negative one.
  const Answer echo = fivepipe("echo FrameComposited --count 1 --from " + file.string());
  EXPECT_TRUE(holds(echo, "latency 9223372036854.78 ms")) << echo.text;
}

TEST_F(RecordingCommands, ExistingRecordingIsOverwrittenOnlyIfForced) {
  const std::string before = content_of(session), file = " " + session.string();
  const std::string deployment = FIVEPIPE_SOURCE_DIR "/tests/system/deployment.yaml";
  for (const std::string& command :
       {"record -o" + file,
        "up " + deployment + " --out " + (folder.path / "out").string() + " --record" + file}) {
    const Answer answer =
        fivepipe(command + " --duration 0.1 --domain " + std::to_string(test::own_domain()));
    EXPECT_EQ(answer.exit_code, 2) << answer.text;
    EXPECT_TRUE(holds(answer, "--force")) << answer.text;
    EXPECT_EQ(content_of(session), before);
  }
  const Answer forced = fivepipe("up /no/such.yaml --record" + file + " --record-option=--force");
  EXPECT_TRUE(holds(forced, "/no/such.yaml") && !holds(forced, "--force")) << forced.text;
  fivepipe("record --force --duration 0.1 -o" + file + " --domain " +
           std::to_string(test::own_domain()));
  EXPECT_NE(content_of(session), before);
}

TEST_F(RecordingCommands, RecordCreatesItsFoldersAndSummarizesTheRecording) {
  const std::string domain = std::to_string(test::own_domain());
  const std::string options = " --topics Colour --duration 0.1 --domain " + domain;
  const fs::path file = folder.path / "new" / "folder" / "a.mcap";
  for (const auto& [where, name] : std::vector<std::pair<std::string, std::string>>{
           {"", file.string()}, {"cd " + folder.path.string() + " && ", "a.mcap"}}) {
    const Answer answer = shell(where + program + "record -o " + name + options + " 2>&1");
    EXPECT_EQ(answer.exit_code, 1) << answer.text;
    EXPECT_TRUE(holds(answer, "\ntopic  received  written  lost  MB\n" + name + ": 0 messages, "))
        << answer.text;
    EXPECT_TRUE(holds(answer, "received no message; `fivepipe ls --domain " + domain + "` lists"))
        << answer.text;
  }
  EXPECT_TRUE(fs::exists(file));
  const Answer none = fivepipe("record --no-colour -o " + (folder.path / "b").string() + options);
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_EQ(none.text, "no topic matches 'Colour'; `fivepipe ls` lists the topics\n");
}

TEST_F(RecordingCommands, RecordUsesTheDomainOfItsDeployment) {
  const std::string domain = std::to_string(test::own_domain());
  const fs::path deployment = folder.path / "deployment.yaml";
  std::string text = content_of(FIVEPIPE_SOURCE_DIR "/launch/deployments/demo.yaml");
  for (const std::string key : {"rig: ", "scene: "})
    text = test::replaced(text, key + "../..", key + FIVEPIPE_SOURCE_DIR);
  std::ofstream(deployment) << "domain: " << domain << "\n" << text;
  const Answer answer = fivepipe("record --topics HeadPose --duration 0.1 --deployment " +
                                 deployment.string() + " -o " + (folder.path / "a.mcap").string());
  EXPECT_TRUE(holds(answer, " of domain " + domain + " to ")) << answer.text;
}

}  // namespace
}  // namespace fivepipe::launch
