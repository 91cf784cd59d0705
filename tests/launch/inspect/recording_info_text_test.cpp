// The text and the JSON of `fivepipe info`, word for word. recording_info_test.cpp reads files.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "launch/inspect/recording_info.h"
#include "tests/support/text.h"

namespace fivepipe::launch {
namespace {

constexpr std::int64_t kRecordingStart_ns = 1'700'000'000'000'000'000;

RecordingInfo complete_info() {
  RecordingInfo info;
  info.file = "session.mcap";
  info.file_bytes = 1'260'000;
  info.read_all = true;
  info.start_ns = kRecordingStart_ns;
  info.end_ns = kRecordingStart_ns + 2'500'000'000;
  info.messages = 110;
  info.chunks = {{"", 1}, {"lz4", 4}};
  info.compressed_bytes = 99'999;
  info.uncompressed_bytes = 250'000;
  info.topics = {{"v/HullTile", "HullTile", 100, 3, 40, 123'456, 0, {"recon_a", "recon_b"}},
                 {"v/State", "State", 7, 0, 2.8, 900, 0, {"sim"}}};
  info.attachments.resize(1);
  info.attachments[0].name = "demo.yaml";
  info.attachments[0].content_bytes = 11;
  info.attachments[0].media_type = "application/yaml";
  info.header = {{"version", "0.1.0"}, {"commit", "abc"}, {"build_type", "Release"},
                 {"domain", "3"},      {"host", "alpha"}, {"cpu", "fast"},
                 {"cores", "8"},       {"deployment", ""}};
  info.settings = {{"data", "/data"}, {"frames", "60"}};
  info.counts = {{"v/HullTile", {.received = 103, .written = 103, .sent = 103}},
                 {"v/State", {.received = 7, .written = 7}}};
  return info;
}

class RecordingInfoText : public testing::Test {
 protected:
  void SetUp() override {
    setenv("TZ", "UTC", 1);
    tzset();
  }
};

TEST_F(RecordingInfoText, DescribesACompleteRecording) {
  EXPECT_EQ(text_of(complete_info()),
            "session.mcap\n"
            "file         1.3 MB, finished; all messages were read, none is damaged\n"
            "start        2023-11-14 22:13:20.000000 +0000   1700000000000000000 ns\n"
            "duration     2.500 s\n"
            "messages     110 in 1 chunk (uncompressed), 4 chunks (lz4), 0.2 MB compressed to "
            "0.100 MB (2.50 : 1)\n"
            "losses       none: 110 received, all written\n"
            "types        those of this build\n"
            "made by      fivepipe 0.1.0 (abc, Release), domain 3\n"
            "on           alpha, fast, 8 cores\n"
            "deployment   none: the recording can be replayed, but does not suffice to start "
            "nodes\n"
            "settings     data=/data, frames=60\n"
            "\n"
            "topic       type      messages     Hz     MB  writers\n"
            "v/HullTile  HullTile       100  40.00  0.123  recon_a, recon_b\n"
            "v/State     State            7   2.80  0.001  sim\n"
            "\n"
            "key changes  HullTile 3\n"
            "\n"
            "attachment  bytes  media type\n"
            "demo.yaml      11  application/yaml\n");
}

// The part of the text from the line that begins with `label` to the line before `next`.
std::string section(const std::string& text, const std::string& label, const std::string& next) {
  const std::size_t begin = text.find("\n" + label) + 1, end = text.find("\n" + next, begin) + 1;
  return text.substr(begin, end - begin);
}
std::string condition(const RecordingInfo& info) {
  return section(text_of(info), "file ", "start");
}
std::string losses(const RecordingInfo& info) {
  const std::string text = text_of(info);
  const std::size_t begin = text.find(" : 1)\n") + 6;
  return text.substr(begin, text.find("\ntypes ", begin) + 1 - begin);
}

TEST_F(RecordingInfoText, StatesTheConditionOfTheFile) {
  RecordingInfo info = complete_info();
  info.file_bytes = 99'999;
  info.read_all = false;
  EXPECT_EQ(condition(info), "file         0.100 MB, finished\n");
  info.read_all = true;
  info.file_bytes = 100'000;
  info.damage.orphaned_messages = 1;
  info.unreadable = {"metadata at byte 9: CRC"};
  const std::string advice =
      "             the damaged records are lost; all others can be read and replayed\n";
  EXPECT_EQ(condition(info),
            "file         0.1 MB, finished\n"
            "DAMAGED      metadata at byte 9: CRC\n"
            "             1 message without a channel\n" +
                advice);
  info.unreadable.clear();
  info.damage.summary = "no summary at the end";
  info.damage.truncated_bytes = 2;
  info.damage.orphaned_messages = 0;
  const std::string unfinished =
      "file         0.1 MB, NOT FINISHED: no index, 2 bytes of an incomplete record at its end\n"
      "             no summary at the end\n"
      "             all messages listed here can be read; repair it by `fivepipe info --recover "
      "session.mcap`\n";
  EXPECT_EQ(condition(info), unfinished);
  info.damage.damage_reports.assign(10, "chunk at byte 5: CRC");
  EXPECT_EQ(test::line_count(condition(info)), 3 + 10 + 1);
  info.damage.damage_reports.resize(12, "chunk at byte 5: CRC");
  EXPECT_EQ(test::line_count(condition(info)), 3 + 11 + 1);
  EXPECT_TRUE(condition(info).starts_with(unfinished + "DAMAGED      chunk at byte 5: CRC\n"
                                                       "             chunk at byte 5: CRC\n"));
  EXPECT_TRUE(condition(info).ends_with("             and 2 more\n" + advice));
  info.damage.damage_reports.clear();
  info.being_written = true;
  EXPECT_EQ(condition(info),
            "file         0.1 MB, BEING WRITTEN: a process has it open; it contains so far:\n");
}

TEST_F(RecordingInfoText, StatesLossesAsFarAsTheyAreKnown) {
  RecordingInfo info = complete_info();
  info.counts.reset();
  EXPECT_EQ(losses(info),
            "losses       none found: sequence numbers have no gaps (the recorder's counts are "
            "missing)\n");
  info.read_all = false;
  EXPECT_EQ(losses(info), "losses       unknown: the recorder's counts are missing\n");
  info.topics[0].missing = 1;
  const std::string gaps =
      "LOST         1 message missing, according to gaps in the sequence numbers:\n"
      "             HullTile 1\n";
  EXPECT_EQ(losses(info), gaps);

  info.counts = {
      {"v/HullTile", {.received = 90, .written = 87, .lost = 3, .sent = 95, .missing = 5}},
      {"v/Pose", {.received = 1, .lost = 1, .sent = 2, .missing = 1}},
      {"v/State", {.received = 5, .written = 5, .sent = 5}}};
  const std::string lost =
      "LOST         6 of 102 messages that nodes sent never reached the recorder\n"
      "             HullTile 5, Pose 1\n"
      "LOST         4 of 96 received messages were dropped: the disk was too slow\n"
      "             HullTile 3, Pose 1\n";
  EXPECT_EQ(losses(info), lost);
  info.topics[0].missing = 4;
  EXPECT_EQ(losses(info), lost) << "the recorder's losses are the gaps";
  info.topics[1].missing = 1;
  EXPECT_EQ(losses(info),
            lost +
                "LOST         5 messages missing, according to gaps in the sequence numbers:\n"
                "             HullTile 4, State 1\n");
  info.loss_reason = "too many writers";
  EXPECT_NE(losses(info).find("dropped: too many writers\n"), std::string::npos);
}

// received - lost: 90 messages; the file has `messages` of them, and `gaps` are known to be
// missing.
TEST_F(RecordingInfoText, StatesWhatACutOffRecordingLacks) {
  RecordingInfo info = complete_info();
  info.counts = {{"v/State", {.received = 100, .written = 50, .lost = 10}}};
  info.counts_stamp_ns = kRecordingStart_ns;
  const std::string dropped =
      "LOST         10 of 100 received messages were dropped: the disk was too slow\n"
      "             State 10\n";
  const std::string known =
      "losses       known until 2023-11-14 22:13:20.000000 +0000; later ones are unknown, because "
      "the recorder did not end\n";
  const auto state = [&](std::uint64_t messages, std::uint64_t gaps) {
    info.messages = messages;
    info.topics[1].missing = gaps;
    return losses(info);
  };
  EXPECT_EQ(state(90, 10), dropped + known);
  EXPECT_EQ(state(110, 0), dropped + known) << "messages that arrived after the counts";
  const auto waited = [](int count) {
    return "LOST         " + std::to_string(count) +
           " of 100 received messages are not in the file: they waited for the disk\n";
  };
  EXPECT_EQ(state(89, 10), dropped + waited(1) + known);
  EXPECT_EQ(state(60, 5), dropped + waited(30) + known);
  const std::string gaps =
      "LOST         15 messages missing, according to gaps in the sequence numbers:\n"
      "             State 15\n";
  EXPECT_EQ(state(60, 15), dropped + gaps + waited(25) + known);
  EXPECT_EQ(state(88, 15), dropped + gaps + known);
  info.counts->at("v/State").lost = 0;
  info.counts->at("v/State").received = 90;
  EXPECT_EQ(state(90, 0),
            "losses       none until 2023-11-14 22:13:20.000000 +0000; later ones are unknown, "
            "because the recorder did not end\n");
  info.final_counts_damaged = true;
  EXPECT_EQ(state(80, 0),
            "LOST         10 of 90 received messages are not in the file\n"
            "losses       known until 2023-11-14 22:13:20.000000 +0000; later ones are unknown, "
            "because the final counts are damaged\n");
}

TEST_F(RecordingInfoText, StatesWhatIsUnknownOfAForeignRecording) {
  RecordingInfo info;
  info.file = "foreign.mcap";
  EXPECT_EQ(text_of(info),
            "foreign.mcap\n"
            "file         0.000 MB, finished\n"
            "messages     none\n"
            "losses       unknown: the recorder's counts are missing\n"
            "made by      unknown: not recorded by fivepipe, or the metadata is missing\n");
  info.header = {{"deployment", "demo"}};
  info.messages = 1;
  info.topics = {{"Thing", "Thing", 1, 0, 0, 0, 0, {"?"}}};
  info.type_differences = {"Thing: no such type"};
  const std::string text = text_of(info);
  EXPECT_EQ(section(text, "duration", "losses"),
            "duration     0.000 s\n"
            "messages     1 in , 0.000 MB compressed to 0.000 MB (0.00 : 1)\n");
  EXPECT_EQ(text.substr(text.find("types")),
            "types DIFFER Thing: no such type\n"
            "             this build can show these topics (`fivepipe echo`), but not replay them\n"
            "made by      fivepipe ? (?, ?), domain ?\n"
            "on           ?, ?, ? cores\n"
            "deployment   demo\n"
            "\n"
            "topic  type   messages  Hz  MB  writers\n"
            "Thing  Thing         1   -   -  ?\n");
}

TEST_F(RecordingInfoText, ListsBreakAt120Columns) {
  RecordingInfo info = complete_info();
  // 13 columns of label, "a=1, " and a setting of 50 characters and one of 48 fill the line, with
  // commas.
  for (const std::size_t last : {48, 49}) {
    info.settings = {{"a", "1"}, {"b", std::string(48, 'x')}, {"c", std::string(last - 2, 'y')}};
    const std::string text = section(text_of(info), "settings", "\ntopic");
    EXPECT_EQ(test::line_count(text), last == 48 ? 1 : 2) << text;
    EXPECT_EQ(text.find(", \n"), std::string::npos);
  }
  info = complete_info();
  info.topics[0].writers = {"writer_with_a_name", "abcd"};
  EXPECT_NE(text_of(info).find("  abcd, writer_with_a_name\n"), std::string::npos) << "24 columns";
  info.topics[0].writers = {"writer_with_a_name", "abcde"};
  EXPECT_EQ(text_of(info).find("  abcde, writer_with_a_name\n"), std::string::npos);
}

TEST_F(RecordingInfoText, RepairsStateWhatIsSavedAndLost) {
  mcap::Recovery recovery;
  recovery.was_finished = true;
  EXPECT_EQ(text_of(recovery, "x.mcap"), "");
  recovery.was_finished = false;
  recovery.statistics.messages = 5;
  recovery.statistics.chunks = 1;
  recovery.statistics.attachments = 2;
  recovery.damage.summary = "no summary";
  const std::string saved =
      "x.mcap was repaired\n"
      "before       no summary\n"
      "saved        5 messages in 1 chunk, 2 attachments\n";
  EXPECT_EQ(text_of(recovery, "x.mcap"), saved + "lost         nothing at the end\n");
  recovery.damage.truncated_bytes = 1;
  recovery.damage.damage_reports = {"chunk at byte 5: CRC"};
  recovery.damage.damaged_records = 1;
  recovery.damage.intact_bytes = 99;
  recovery.damage.orphaned_messages = 3;
  EXPECT_EQ(text_of(recovery, "x.mcap"),
            saved +
                "lost         1 byte of an incomplete record at the end\n"
                "lost         chunk at byte 5: CRC\n"
                "lost         3 messages without a channel\n");
  EXPECT_EQ(json_of(recovery).dump(),
            R"({"was_finished":false,"messages":5,"chunks":1,"damage":{"summary":"no summary",)"
            R"("intact_bytes":99,"truncated_bytes":1,"damaged_records":1,)"
            R"("damage_reports":["chunk at byte 5: CRC"],"orphaned_messages":3}})");
}

TEST(RecordingInfoJson, HasEveryField) {
  RecordingInfo info = complete_info();
  EXPECT_EQ(
      json_of(info).dump(),
      R"({"file":"session.mcap","file_bytes":1260000,"finished":true,"being_written":false,)"
      R"("intact":true,"unreadable":[],"start_ns":1700000000000000000,)"
      R"("end_ns":1700000002500000000,"duration_s":2.5,"messages":110,"chunks":{"":1,"lz4":4},)"
      R"("compressed_bytes":99999,"uncompressed_bytes":250000,"topics":[{"topic":"v/HullTile",)"
      R"("type":"HullTile","messages":100,"key_changes":3,"rate_hz":40.0,"bytes":123456,)"
      R"("missing_sequence_numbers":0,"writers":["recon_a","recon_b"]},{"topic":"v/State",)"
      R"("type":"State","messages":7,"key_changes":0,"rate_hz":2.8,"bytes":900,)"
      R"("missing_sequence_numbers":0,"writers":["sim"]}],"counts":{"v/HullTile":{"received":103,)"
      R"("written":103,"lost":0,"sent":103,"missing":0},"v/State":{"received":7,"written":7,)"
      R"("lost":0}},"counts_stamp_ns":null,"type_differences":[],"recording":{"build_type":)"
      R"("Release","commit":"abc","cores":"8","cpu":"fast","deployment":"","domain":"3","host":)"
      R"("alpha","version":"0.1.0"},"settings":{"data":"/data","frames":"60"},"attachments":)"
      R"([{"name":"demo.yaml","bytes":11,"media_type":"application/yaml"}]})");
  info.read_all = false;
  info.being_written = true;
  info.damage.summary = "no summary";
  info.counts_stamp_ns = 5;
  info.loss_reason = "too slow";
  const nlohmann::ordered_json json = json_of(info);
  EXPECT_FALSE(json["finished"]);
  EXPECT_FALSE(json["intact"]);
  EXPECT_TRUE(json["being_written"]);
  EXPECT_EQ(json["damage"]["summary"], "no summary");
  EXPECT_EQ(json["counts_stamp_ns"], 5);
  EXPECT_EQ(json["loss_reason"], "too slow");
  EXPECT_FALSE(json["topics"][0].contains("bytes"));
  info.counts.reset();
  EXPECT_TRUE(json_of(info)["counts"].is_null());
}

}  // namespace
}  // namespace fivepipe::launch
