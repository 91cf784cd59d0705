#include "tests/launch/cli/recording_commands.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>
#include <random>

#include "common/config/deployment.h"
#include "common/recording/files/format.h"
#include "tests/support/recording/kept_recording.h"

namespace fivepipe::launch {
namespace {

TEST_F(RecordingCommands, InfoDescribesRecording) {
  const Answer answer = fivepipe("info " + session.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  for (const char* part : {"all messages were read, none is damaged",
                           "2023-11-14 22:13:20.002000 +0000   1700000000002000000 ns", "0.998 s",
                           "98 in", "none: 98 received", "those of this build", "0.1.0 (abc",
                           "frames=60", "deployment   demo", "key changes", "deployment/demo.yaml"})
    EXPECT_TRUE(holds(answer, part)) << part << "\n" << answer.text;
  EXPECT_LE(longest_line(answer.text), 120u) << answer.text;
  EXPECT_TRUE(answer.text.starts_with(session.string() + "\n")) << "no word about a repair";
}

TEST_F(RecordingCommands, InfoIsJsonForPrograms) {
  const fs::path file = folder.path / "größe.mcap";
  fs::rename(session, file);
  const Answer answer = fivepipe("info --json " + file.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_TRUE(answer.text.starts_with("{\n  \"file\": \"" + file.string() + "\",\n  \""))
      << answer.text;
  const auto json = nlohmann::json::parse(answer.text);
  EXPECT_EQ(json["finished"], true);
  EXPECT_EQ(json["messages"], 98);
  EXPECT_EQ(json["start_ns"], start_ns + 2 * ms);
  EXPECT_EQ(json["counts"][kCompositedTopic]["written"], 96);
  const auto& topic = json["topics"][0];
  EXPECT_EQ(topic["topic"], kCompositedTopic);
  EXPECT_EQ(topic["messages"], 96);
  EXPECT_EQ(topic["key_changes"], 1);
  EXPECT_EQ(topic["missing_sequence_numbers"], 0);
  EXPECT_EQ(topic["writers"], nlohmann::json::array({"render"}));
  EXPECT_EQ(topic["bytes"], 96 * frame_cdr("viewer", 0).size() + key_cdr("viewer").size());
  EXPECT_EQ(json["topics"][1]["bytes"], 88) << "one pose";
  EXPECT_EQ(json["attachments"][0]["bytes"], 11);
}

TEST_F(RecordingCommands, InfoSuggestsWorkingRecoverCommand) {
  const fs::path cut = cut_session(fs::file_size(session) / 2);
  const std::string before = content_of(cut), repaired = (folder.path / "repaired.mcap").string();
  const Answer unfinished = fivepipe("info " + cut.string());
  EXPECT_EQ(unfinished.exit_code, 1) << unfinished.text;
  EXPECT_TRUE(holds(unfinished, "NOT FINISHED")) << unfinished.text;
  EXPECT_TRUE(holds(unfinished, "`fivepipe info --recover " + cut.string() + "`"))
      << unfinished.text;

  const Answer copy = fivepipe("info --recover " + cut.string() + " --output " + repaired);
  EXPECT_EQ(copy.exit_code, 0) << copy.text;
  EXPECT_TRUE(holds(copy, "saved") && holds(copy, "lost") && holds(copy, "was repaired") &&
              !holds(copy, "needs no repair"))
      << copy.text;
  EXPECT_EQ(content_of(cut), before);
  EXPECT_EQ(fivepipe("info --recover " + cut.string() + " --output " + repaired).exit_code, 2)
      << "the output file exists";
  // It neither waits for nor is refused because of its own check that no process writes the file.
  EXPECT_EQ(shell("timeout 60 " + program + "info --recover " + cut.string()).exit_code, 0);
  EXPECT_EQ(content_of(cut), content_of(repaired));
  const Answer again = fivepipe("info --recover " + cut.string());
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_TRUE(holds(again, "needs no repair") && !holds(again, "was repaired")) << again.text;
  EXPECT_EQ(fivepipe("info --output x " + cut.string()).exit_code, 2);
}

TEST_F(RecordingCommands, InfoDoesNotModifyFileBeingWritten) {
  const fs::path cut = cut_session(fs::file_size(session) / 2);
  const std::string before = content_of(cut);
  std::ofstream recorder(cut, std::ios::binary | std::ios::app);
  const Answer answer = fivepipe("info " + cut.string());
  EXPECT_EQ(answer.exit_code, 1);
  EXPECT_TRUE(holds(answer, "BEING WRITTEN")) << answer.text;
  const Answer refused = fivepipe("info --recover " + cut.string());
  EXPECT_EQ(refused.exit_code, 2) << refused.text;
  EXPECT_EQ(content_of(cut), before);
}

TEST_F(RecordingCommands, InfoFindsADamagedChunkOfAFinishedFile) {
  std::string bytes = content_of(session);
  const std::size_t damaged = fs::file_size(session) / 3;
  bytes[damaged] = char(bytes[damaged] ^ 0x55);
  std::ofstream(session, std::ios::binary) << bytes;
  const Answer answer = fivepipe("info " + session.string());
  EXPECT_EQ(answer.exit_code, 1) << answer.text;
  EXPECT_TRUE(
      holds(answer, "DAMAGED") &&
      holds(answer, "according to gaps in the sequence numbers:\n             FrameComposited ") &&
      !holds(answer, "all written"))
      << answer.text;
  EXPECT_EQ(fivepipe("info --quick " + session.string()).exit_code, 0) << "the index is undamaged";
  const Answer echo = fivepipe("echo FrameComposited --field frame --from " + session.string());
  EXPECT_EQ(echo.exit_code, 1) << echo.text;
  EXPECT_TRUE(holds(echo, "--- 0 ") && holds(echo, "--- 99 ") &&
              holds(echo, "skipping the damaged chunk"))
      << echo.text;
}

TEST_F(RecordingCommands, InfoExtractsRecordedDeployment) {
  const fs::path extracted = folder.path / "extracted";
  const Answer answer =
      fivepipe("info " + test::kKeptRecording + " --extract " + extracted.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  const std::string start = "--deployment ";
  const auto begin = answer.text.find(start) + start.size();
  const fs::path file = answer.text.substr(begin, answer.text.find(' ', begin) - begin);
  EXPECT_TRUE(fs::exists(file)) << answer.text;
  EXPECT_EQ(config::load_deployment(file, {}).name, "small");
  EXPECT_EQ(fivepipe("info " + test::kKeptRecording + " --extract " + extracted.string()).exit_code,
            2)
      << "the folder is not empty";
  for (const std::string other : {"--json", "--quick"}) {
    const fs::path unused = folder.path / "unused";
    EXPECT_EQ(
        fivepipe("info " + test::kKeptRecording + " --extract " + unused.string() + " " + other)
            .exit_code,
        2)
        << other;
    EXPECT_FALSE(fs::exists(unused)) << other;
  }
  const Answer without =
      fivepipe("info " + session.string() + " --extract " + (folder.path / "new").string());
  EXPECT_EQ(without.exit_code, 2);
  EXPECT_TRUE(holds(without, "no deployment")) << without.text;
}

TEST_F(RecordingCommands, InfoPrintsTheCommandThatStartsANodeWithTheRecordedSettings) {
  const fs::path extracted = folder.path / "extracted";
  {
    recording::RecordingWriter writer(session, "test", {});
    writer.attach({1, 1, "deployment/a/demo.yaml", "application/yaml", "name: demo\n"});
    writer.add(mcap::Metadata{recording::kRecordingMetadata,
                              {{recording::kDeploymentFileKey, "a/demo.yaml"}}});
    writer.add(mcap::Metadata{recording::kSettingsMetadata, {{"data", "/data"}, {"frames", "60"}}});
    writer.finish();
  }
  fs::create_directory(extracted);  // it may be empty
  const Answer answer = fivepipe("info " + session.string() + " --extract " + extracted.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  EXPECT_EQ(answer.text, "extracted to " + extracted.string() +
                             "; start a node with\n  recon_node --deployment " +
                             (extracted / "a" / "demo.yaml").string() +
                             " --set data=/data --set frames=60 --node NAME\n");
  EXPECT_EQ(content_of(extracted / "a" / "demo.yaml"), "name: demo\n");
}

TEST_F(RecordingCommands, InfoReportsLosses) {
  write_session(session, {.chunk_bytes = 100'000, .max_queued_bytes = 2000});
  const Answer answer = fivepipe("info " + session.string());
  EXPECT_TRUE(holds(answer, "LOST") && holds(answer, "of 98 received messages were dropped") &&
              holds(answer, "FrameComposited "))
      << answer.text;
  EXPECT_LE(longest_line(answer.text), 120u) << answer.text;
}

// The recorder was killed: the file has 60 messages and the counts that it wrote before.
TEST_F(RecordingCommands, InfoOfACutOffRecordingReportsItsLosses) {
  const fs::path file = folder.path / "cut_off.mcap";
  const auto write = [&](std::uint64_t received, std::uint64_t lost) {
    mcap::FileWriter writer(file, mcap::Compression::none, "");
    mcap::ChunkBuilder chunk;
    const auto channel =
        chunk.add_channel({chunk.add_schema({kCompositedType, recording::kSchemaEncoding,
                                             schema::fivepipe_schema(kCompositedType)}),
                           kCompositedTopic,
                           recording::kMessageEncoding,
                           {{"node", "render"}}});
    for (std::uint32_t i = 0; i < 60; ++i) {
      const auto cdr = frame_cdr("viewer", i);
      chunk.add({channel, i, std::uint64_t(start_ns), std::uint64_t(start_ns), cdr});
    }
    mcap::Metadata counts{recording::kCountsSoFarMetadata,
                          {{kCompositedTopic + " received", std::to_string(received)},
                           {kCompositedTopic + " written", "40"},
                           {kCompositedTopic + " lost", std::to_string(lost)},
                           {recording::kCountsStampKey, std::to_string(start_ns)}}};
    if (lost > 0) counts.values[recording::kLossReasonKey] = "the disk was too slow";
    writer.add(counts);
    writer.write(chunk.take());
  };
  write(100, 10);
  const Answer lost = fivepipe("info " + file.string());
  EXPECT_TRUE(holds(lost, "10 of 100 received messages were dropped: the disk was too slow"));
  EXPECT_TRUE(holds(lost, "30 of 100 received messages are not in the file")) << lost.text;
  EXPECT_TRUE(holds(lost, "losses       known until 2023-11-14 22:13:20")) << lost.text;
  const Answer json = fivepipe("info --json " + file.string());
  const auto parsed = nlohmann::json::parse(json.text);
  EXPECT_EQ(parsed["counts_stamp_ns"], start_ns);
  EXPECT_EQ(parsed["counts"][kCompositedTopic]["lost"], 10);
  // After the repair too, the file is one that was cut off.
  const Answer repaired = fivepipe("info --recover " + file.string());
  EXPECT_TRUE(holds(repaired, "30 of 100 received messages are not in the file")) << repaired.text;
  write(60, 0);
  const Answer none = fivepipe("info " + file.string());
  EXPECT_TRUE(holds(none, "losses       none until 2023-11-14 22:13:20")) << none.text;
  EXPECT_FALSE(holds(none, "LOST")) << none.text;
}

TEST_F(RecordingCommands, InfoAndEchoHandleTypesOfAnotherBuild) {
  write_session(
      session, {},
      "module fivepipe { module v1 { struct FrameComposited {"
      " @key string<32> viewer; unsigned long long number; long long a; long long b; }; }; };");
  const Answer info = fivepipe("info " + session.string());
  EXPECT_EQ(info.exit_code, 0) << info.text;
  EXPECT_TRUE(holds(info, "types DIFFER") && holds(info, kCompositedTopic) && holds(info, "number"))
      << info.text;
  const Answer echo = fivepipe("echo FrameComposited --count 1 --from " + session.string());
  EXPECT_EQ(echo.exit_code, 0) << echo.text;
  EXPECT_TRUE(holds(echo, "number: 0\n")) << echo.text;
}

TEST_F(RecordingCommands, ErrorNamesFileThatIsNotARecording) {
  const fs::path empty = folder.path / "empty.mcap", text = folder.path / "text.mcap";
  const fs::path no_schema = folder.path / "no_schema.mcap",
                 no_message = folder.path / "no_message.mcap";
  std::ofstream(empty).close();
  std::ofstream(text) << "this is not a recording";
  { recording::RecordingWriter writer(no_message, "test", {}); }
  write_session(no_schema, {}, "struct {");
  for (const std::string command :
       {"info ", "ls ", "echo FrameComposited --from ", "hz FrameComposited --from "}) {
    for (const fs::path& file : {empty, text}) {
      const Answer answer = fivepipe(command + file.string());
      EXPECT_EQ(answer.exit_code, 1) << command << answer.text;
      EXPECT_TRUE(holds(answer, file.string()) && holds(answer, "not an MCAP file"))
          << command << answer.text;
    }
    EXPECT_EQ(fivepipe(command + "/no/such.mcap").exit_code, 2) << command;
    EXPECT_EQ(fivepipe(command + folder.path.string()).exit_code, 2) << command;
    EXPECT_NE(fivepipe(command + no_schema.string()).exit_code, -1) << command;
  }
  EXPECT_EQ(fivepipe("info " + no_message.string()).exit_code, 0);
  EXPECT_EQ(fivepipe("ls " + no_message.string()).exit_code, 0);
  EXPECT_EQ(fivepipe("echo HeadPose --from " + no_message.string()).exit_code, 2);
  EXPECT_EQ(fivepipe("echo FrameComposited --from " + no_schema.string()).exit_code, 1);
}

// Reading a pipe would wait for its writer for ever.
TEST_F(RecordingCommands, APipeIsNotARecording) {
  const fs::path pipe = folder.path / "pipe.mcap";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& command : std::vector<std::string>{
           "info ", "info --recover ", "info --extract " + (folder.path / "out").string() + " ",
           "ls ", "echo HeadPose --from ", "hz HeadPose --from ", "replay ",
           "bench recon_node --from "}) {
    const Answer answer = shell("timeout 60 " + program + command + pipe.string() + " 2>&1");
    EXPECT_EQ(answer.exit_code, 1) << command << answer.text;
    EXPECT_TRUE(holds(answer, pipe.string()) && holds(answer, "not a regular file"))
        << command << answer.text;
  }
}

TEST_F(RecordingCommands, DamagedFilesAreReadUpToTheDamage) {
  std::mt19937 random(11);
  const std::string whole = content_of(session);
  const fs::path file = folder.path / "bad.mcap";
  for (int i = 0; i < 24; ++i) {
    std::string bytes = whole;
    if (i % 2)
      bytes.resize(random() % bytes.size());
    else
      for (int n = 0; n < 3; ++n) bytes[random() % bytes.size()] = char(random());
    std::ofstream(file, std::ios::binary) << bytes;
    for (const std::string command :
         {"info ", "info --json ", "ls ", "echo FrameComposited --from ",
          "hz FrameComposited --from "}) {
      const Answer answer = fivepipe(command + file.string());
      EXPECT_TRUE(answer.exit_code >= 0 && answer.exit_code <= 2) << command << i << "\n"
                                                                  << answer.text;
      EXPECT_FALSE(answer.text.empty()) << command << i;
      const bool is_cut = i % 2;
      if (is_cut && command.starts_with("info")) {
        EXPECT_EQ(answer.exit_code, 1) << command << i << "\n" << answer.text;
      }
    }
  }
}

TEST_F(RecordingCommands, InfoShowsMissingMessages) {
  const fs::path file = folder.path / "missing.mcap";
  {
    recording::RecordingWriter writer(file, "test", {});
    writer.add_sent(kHeadTopic, 40, 7);
  }
  const Answer answer = fivepipe("info " + file.string());
  EXPECT_TRUE(holds(answer, "LOST         7 of 40 messages that nodes sent") &&
              holds(answer, "HeadPose 7"))
      << answer.text;
}

}  // namespace
}  // namespace fivepipe::launch
