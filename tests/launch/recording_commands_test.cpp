// `fivepipe info`, `ls`, `echo` and `hz` as a user calls them, on small recordings that are written
// here, and on the bus.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <sstream>
#include <thread>

#include "common/pipeline/bus/bus.h"
#include "common/recording/files/recording_writer.h"
#include "common/recording/schema/wire_types.h"
#include "tests/support/mcap_files.h"
#include "tests/support/test_domain.h"

namespace fivepipe::launch {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

struct Answer {
  int exit_code = -1;  // -1: killed by a signal
  std::string text;    // stdout and stderr
};

Answer shell(const std::string& line) {
  Answer answer;
  FILE* pipe = popen(line.c_str(), "r");
  if (!pipe) return answer;
  char buffer[4096];
  while (const std::size_t got = fread(buffer, 1, sizeof buffer, pipe))
    answer.text.append(buffer, got);
  const int status = pclose(pipe);
  if (WIFEXITED(status) && WEXITSTATUS(status) < 128) answer.exit_code = WEXITSTATUS(status);
  return answer;
}
const std::string program = FIVEPIPE_BINARY_DIR "/fivepipe ";
Answer fivepipe(const std::string& arguments) {
  return shell("TZ=UTC " + program + arguments + " 2>&1");
}

bool holds(const Answer& answer, const std::string& part) {
  return answer.text.find(part) != std::string::npos;
}

constexpr std::int64_t start_ns = 1'700'000'000'000'000'000, ms = 1'000'000;

// FrameComposited, or Note, which is laid out as it: little-endian CDR.
std::vector<std::byte> frame_cdr(const std::string& key, std::uint64_t frame) {
  std::vector<std::byte> bytes{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  const auto put = [&](auto value) {
    while ((bytes.size() - 4) % sizeof value) bytes.push_back(std::byte{0});
    const auto* raw = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), raw, raw + sizeof value);
  };
  put(std::uint32_t(key.size() + 1));
  for (const char c : key) put(c);
  put('\0');
  put(frame);
  put(start_ns);
  put(start_ns + 20 * ms);
  return bytes;
}
std::vector<std::byte> key_cdr(const std::string& key) {
  auto bytes = frame_cdr(key, 0);
  bytes.resize(8 + key.size() + 1);
  return bytes;
}

constexpr const char* kCompositedType = "fivepipe::v1::FrameComposited";
const std::string kCompositedTopic = bus::topics::FrameComposited::name,
                  kHeadTopic = bus::topics::HeadPose::name;

// 100 frames at 100 Hz less 17 and 40..42, each taken 2 ms after it was sent, a chunk every ten.
void write_session(const fs::path& file,
                   const recording::WriterOptions& options = {.chunk_bytes = 700},
                   const std::string& schema = schema::fivepipe_schema(kCompositedType)) {
  recording::RecordingWriter writer(file, "test", options);
  writer.attach({1, 1, "deployment/demo.yaml", "application/yaml", "name: demo\n"});
  writer.add(mcap::Metadata{
      "recording",
      {{"version", "0.1.0"}, {"commit", "abc"}, {"deployment", "demo"}, {"domain", "3"}}});
  writer.add(mcap::Metadata{"settings", {{"frames", "60"}}});
  const auto render = writer.add_channel(kCompositedTopic, kCompositedType, schema,
                                         {{"node", "render"},
                                          {"writer", "0123"},
                                          {"qos.history", "keep_last 64"},
                                          {"qos.reliability", "reliable, blocks 100 ms"}});
  const auto head =
      writer.add_channel(kHeadTopic, "fivepipe::v1::HeadPose",
                         schema::fivepipe_schema("fivepipe::v1::HeadPose"), {{"node", "capture"}});
  // Zeros, but for the length of the empty viewer's name: two 64-bit integers, seven doubles, an
  // empty sequence.
  std::vector<std::byte> head_cdr(4 + 8 + 9 * 8 + 4, std::byte{0});
  head_cdr[1] = head_cdr[4] = std::byte{1};
  for (int frame = 0; frame < 100; ++frame) {
    if (frame == 17 || (frame >= 40 && frame <= 42)) continue;
    const std::int64_t sent_ns = start_ns + frame * 10 * ms;
    writer.add(render, sent_ns + 2 * ms, sent_ns, frame_cdr("viewer", std::uint64_t(frame)));
    if (frame == 50) writer.add(head, sent_ns + 3 * ms, sent_ns, head_cdr);
  }
  writer.add(render, start_ns + 1000 * ms, start_ns + 999 * ms, recording::KeyChange::unregistered,
             key_cdr("viewer"));
  writer.finish();
}

std::size_t longest_line(const std::string& text) {
  std::size_t longest = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) longest = std::max(longest, line.size());
  return longest;
}

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class RecordingCommands : public testing::Test {
 protected:
  RecordingCommands() { write_session(session); }
  fs::path cut_session(std::size_t bytes) {
    fs::path cut = folder.path / "cut.mcap";
    fs::copy_file(session, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, bytes);
    return cut;
  }
  const test::TestFolder folder;
  const fs::path session = folder.path / "session.mcap";
};

TEST_F(RecordingCommands, InfoDescribesRecording) {
  const Answer answer = fivepipe("info " + session.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
  for (const char* part : {"all of it was read, and is whole",
                           "2023-11-14 22:13:20.002000 +0000   1700000000002000000 ns", "0.998 s",
                           "98 in", "none: 98 received", "those of this build", "0.1.0 (abc",
                           "frames=60", "deployment   demo", "key changes", "deployment/demo.yaml"})
    EXPECT_TRUE(holds(answer, part)) << part << "\n" << answer.text;
  EXPECT_LE(longest_line(answer.text), 120u) << answer.text;
}

TEST_F(RecordingCommands, InfoIsJsonForPrograms) {
  const Answer answer = fivepipe("info --json " + session.string());
  EXPECT_EQ(answer.exit_code, 0) << answer.text;
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
  EXPECT_EQ(json["attachments"][0]["bytes"], 11);
}

TEST_F(RecordingCommands, InfoSuggestsWorkingRecoverCommand) {
  const fs::path cut = cut_session(fs::file_size(session) / 2);
  const std::string before = content_of(cut), mended = (folder.path / "mended.mcap").string();
  const Answer unfinished = fivepipe("info " + cut.string());
  EXPECT_EQ(unfinished.exit_code, 1) << unfinished.text;
  EXPECT_TRUE(holds(unfinished, "NOT FINISHED")) << unfinished.text;
  EXPECT_TRUE(holds(unfinished, "`fivepipe info --recover " + cut.string() + "`"))
      << unfinished.text;

  const Answer copy = fivepipe("info --recover " + cut.string() + " --output " + mended);
  EXPECT_EQ(copy.exit_code, 0) << copy.text;
  EXPECT_TRUE(holds(copy, "saved") && holds(copy, "lost") && holds(copy, "was mended"))
      << copy.text;
  EXPECT_EQ(content_of(cut), before);
  EXPECT_EQ(fivepipe("info --recover " + cut.string() + " --output " + mended).exit_code, 2)
      << "what is there would be replaced";
  EXPECT_EQ(fivepipe("info --recover " + cut.string()).exit_code, 0);
  EXPECT_EQ(content_of(cut), content_of(mended));
  const Answer again = fivepipe("info --recover " + cut.string());
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_TRUE(holds(again, "nothing to mend")) << again.text;
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
  const std::size_t middle = fs::file_size(session) / 3;
  bytes[middle] = char(bytes[middle] ^ 0x55);
  std::ofstream(session, std::ios::binary) << bytes;
  const Answer answer = fivepipe("info " + session.string());
  EXPECT_EQ(answer.exit_code, 1) << answer.text;
  EXPECT_TRUE(holds(answer, "DAMAGED") &&
              holds(answer, "by gaps in their sequence numbers:\n             FrameComposited ") &&
              !holds(answer, "all written"))
      << answer.text;
  EXPECT_EQ(fivepipe("info --quick " + session.string()).exit_code, 0) << "its index is whole";
  const Answer echo = fivepipe("echo FrameComposited --field frame --from " + session.string());
  EXPECT_EQ(echo.exit_code, 1) << echo.text;
  EXPECT_TRUE(holds(echo, "--- 0 ") && holds(echo, "--- 99 ") && holds(echo, "passed over"))
      << echo.text;
}

TEST_F(RecordingCommands, InfoReportsLosses) {
  write_session(session, {.chunk_bytes = 100'000, .max_queued_bytes = 2000});
  const Answer answer = fivepipe("info " + session.string());
  EXPECT_TRUE(holds(answer, "LOST") && holds(answer, "of 98 that the recorder received") &&
              holds(answer, "FrameComposited "))
      << answer.text;
  EXPECT_LE(longest_line(answer.text), 120u) << answer.text;
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

TEST_F(RecordingCommands, ErrorNamesFileThatIsNoRecording) {
  const fs::path empty = folder.path / "empty.mcap", text = folder.path / "text.mcap";
  const fs::path no_schema = folder.path / "no_schema.mcap",
                 no_message = folder.path / "no_message.mcap";
  std::ofstream(empty).close();
  std::ofstream(text) << "this is no recording";
  { recording::RecordingWriter writer(no_message, "test", {}); }
  write_session(no_schema, {}, "struct {");
  for (const std::string command :
       {"info ", "ls ", "echo FrameComposited --from ", "hz FrameComposited --from "}) {
    for (const fs::path& file : {empty, text}) {
      const Answer answer = fivepipe(command + file.string());
      EXPECT_EQ(answer.exit_code, 1) << command << answer.text;
      EXPECT_TRUE(holds(answer, file.string()) && holds(answer, "no MCAP file"))
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
  // Log stamps start at 2 ms: frames 50 and 51 are taken 0.5 and 0.51 s after the first.
  EXPECT_EQ(fivepipe("echo composited --field frame --start 0.5 --end 0.51" + from).text,
            "--- 50  # 22:13:20.500000 render, latency 2.00 ms\n--- 51  # 22:13:20.510000 render, "
            "latency 2.00 ms\n");
  const Answer last = fivepipe("echo FrameComposited --json --start 0.99" + from + " | tail -n 1");
  const auto line = nlohmann::json::parse(last.text);
  EXPECT_EQ(line["key_change"], "unregistered");
  EXPECT_EQ(line["key"]["viewer"], "viewer");
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
  EXPECT_TRUE(holds(none, "no message in this time")) << none.text;
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

// Somebody who writes frames on the bus for as long as this lives.
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
  const auto told = nlohmann::json::parse(line);
  EXPECT_EQ(told["key_change"], "unregistered");
  EXPECT_EQ(told["key"]["viewer"], "viewer");
  EXPECT_EQ(told["writer"], "render_x");
  EXPECT_EQ(pclose(echo), 0) << "nothing comes any more, but the pipe is closed";
}

TEST(RecordingCommandsLive, ReportEmptyDomain) {
  const std::string in_domain = " --domain " + std::to_string(test::own_domain());
  const Answer ls = fivepipe("ls" + in_domain);
  EXPECT_EQ(ls.exit_code, 3) << ls.text;
  EXPECT_TRUE(holds(ls, "nobody")) << ls.text;
  EXPECT_EQ(fivepipe("hz HeadPose --once 0.3" + in_domain).exit_code, 3);
  EXPECT_EQ(fivepipe("echo NoSuchTopic" + in_domain).exit_code, 2);
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
  fivepipe("record --force --duration 0.1 -o" + file + " --domain " +
           std::to_string(test::own_domain()));
  EXPECT_NE(content_of(session), before);
}

// Its counts of what nodes sent are shown.
TEST_F(RecordingCommands, InfoShowsMissingMessages) {
  const fs::path file = folder.path / "missing.mcap";
  {
    recording::RecordingWriter writer(file, "test", {});
    writer.add_sent(kHeadTopic, 40, 7);
  }
  const Answer answer = fivepipe("info " + file.string());
  EXPECT_TRUE(holds(answer, "LOST         7 of 40 that nodes sent") && holds(answer, "HeadPose 7"))
      << answer.text;
}

}  // namespace
}  // namespace fivepipe::launch
