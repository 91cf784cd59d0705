// The texts of `fivepipe record`, `replay`, `ls` and `hz`, word for word.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "launch/inspect/arrival_statistics.h"
#include "launch/inspect/record_report.h"
#include "launch/inspect/replay_report.h"
#include "launch/inspect/topic_list.h"
#include "tests/support/text.h"

namespace fivepipe::launch {
namespace {

replay::RecordRequest request() {
  replay::RecordRequest request;
  request.file = "out/session.mcap";
  request.domain = 7;
  return request;
}

replay::RecordResult complete_recording() {
  replay::RecordResult result;
  result.counts["v/HullTile"] = {
      .received = 100, .lost = 0, .bytes = 12'340'000, .written = 100, .sent = 100, .missing = 0};
  result.counts["v/State"] = {
      .received = 7, .lost = 0, .bytes = 150'000, .written = 6, .sent = 7, .missing = 0};
  result.bytes_written = 5'550'000;
  result.elapsed_s = 10.26;
  result.finished = result.synced = true;
  return result;
}

TEST(RecordReport, SummaryListsTopicsAndSumsThem) {
  EXPECT_EQ(summary_text(request(), complete_recording()),
            "topic       received  written  lost    MB\n"
            "v/HullTile       100      100     0  12.3\n"
            "v/State            7        6     0   0.1\n"
            "out/session.mcap: 106 messages, 5.5 MB, 10.3 s\n");
  EXPECT_EQ(problems_text(request(), complete_recording()), "");
}

TEST(RecordReport, NamesTheNodesWhoseMessagesAreMissingAtMostTwenty) {
  replay::RecordResult result = complete_recording();
  result.sent = {{"whole", "v/State", 5, 5}, {"recon_a", "v/HullTile", 101, 100}};
  result.unverified_nodes = {"", "sim"};
  EXPECT_EQ(problems_text(request(), result),
            "recon_a sent 101 messages of v/HullTile, the recorder received 100\n"
            "cannot check for losses; no recent send counts from: (unnamed), sim\n");
  result.unverified_nodes.clear();
  result.sent.assign(20, {"recon_a", "v/HullTile", 101, 100});
  EXPECT_EQ(test::line_count(problems_text(request(), result)), 20);
  result.sent.assign(22, {"recon_a", "v/HullTile", 101, 100});
  EXPECT_EQ(test::line_count(problems_text(request(), result)), 21);
  EXPECT_TRUE(problems_text(request(), result).ends_with("and 2 more such lines\n"));

  result.sent.clear();
  for (int i = 10; i < 30; ++i) result.unverified_nodes.insert("n" + std::to_string(i));
  EXPECT_TRUE(problems_text(request(), result).ends_with(", n28, n29\n"));
  result.unverified_nodes.insert("n30");
  EXPECT_TRUE(problems_text(request(), result).ends_with(", n28, n29, and 1 more\n"));
}

TEST(RecordReport, StatesLossesAndFailuresOfTheDisk) {
  replay::RecordResult result = complete_recording();
  result.counts["v/HullTile"].lost = 1;
  result.loss_reason = "the disk was too slow";
  EXPECT_EQ(problems_text(request(), result), "1 message lost: the disk was too slow\n");
  result.counts["v/State"].lost = 3;
  result.finished = false;
  EXPECT_EQ(problems_text(request(), result),
            "4 messages lost: the disk was too slow\n"
            "the disk was too slow to take the index; repair the file by `fivepipe info --recover "
            "out/session.mcap`.\n");
  result.failure = "out/session.mcap: no space left";
  result.synced = false;
  const std::string repair =
      "The file holds everything up to the failure; repair it by `fivepipe info --recover "
      "out/session.mcap`.\n";
  EXPECT_EQ(problems_text(request(), result), "4 messages lost: the disk was too slow\n" + repair);
  for (auto& [topic, count] : result.counts) count.lost = 0;
  EXPECT_EQ(problems_text(request(), result), result.failure + "\n" + repair);
  result = complete_recording();
  result.synced = false;
  EXPECT_EQ(problems_text(request(), result),
            "the disk has not confirmed the end of out/session.mcap; a power cut within the next "
            "seconds may lose it\n");
  result.synced = true;
  for (auto& [topic, count] : result.counts) count.received = 0;
  EXPECT_EQ(problems_text(request(), result),
            "received no message; `fivepipe ls --domain 7` lists the nodes that write there\n");
}

TEST(ReplayReport, ListsTopicsNodesAndWhatIsMissing) {
  replay::ReplayCounts counts;
  counts.in_file = {{"v/HullTile", 100}, {"v/State", 7}};
  counts.sent = {{"v/HullTile", 98}, {"v/State", 7}};
  counts.seconds = 1.256;
  const std::string topics =
      "topic       in file  sent\n"
      "v/HullTile      100    98\n"
      "v/State           7     7\n";
  EXPECT_EQ(text_of(counts), topics + "1.26 s\n");
  counts.expected = {{"recon_a", 30}};
  counts.handled = {{"recon_a", 29}};
  counts.damaged = 1;
  counts.late = 2;
  EXPECT_EQ(text_of(counts), topics +
                                 "node     frames  handled\n"
                                 "recon_a      30       29\n"
                                 "1 damaged chunk of the file skipped\n"
                                 "2 messages too far behind their frame in the file\n"
                                 "1.26 s\n");
}

TEST(ArrivalTable, ShowsEachWriterAndAll) {
  ArrivalStatistics statistics;
  const std::int64_t ms = 1'000'000;
  for (const int i : {0, 1, 2, 4})
    statistics.add("a", {i * 10 * ms, (i + 2) * ms, 50'000}, std::uint64_t(2 * i));
  EXPECT_EQ(statistics.text(),
            "writer  messages     Hz   MB/s  interval ms: min  median    p95    max  latency ms: "
            "median   p95   max\n"
            "a              4  75.00  3.750             10.00   10.00  20.00  20.00                "
            "3.50  6.00  6.00\n"
            "4 frames, 5 missing between them: 1, 3, 5..7\n");
  statistics.add("b", {40 * ms, 0, 7}, std::nullopt);
  EXPECT_EQ(statistics.text(),
            "writer  messages      Hz   MB/s  interval ms: min  median    p95    max  latency ms: "
            "median   p95   max\n"
            "a              4   75.00  3.750             10.00   10.00  20.00  20.00               "
            " 3.50  6.00  6.00\n"
            "b              1       -      -                 -       -      -      -               "
            " 0.00  0.00  0.00\n"
            "all            5  100.00  3.750              0.00   10.00  20.00  20.00               "
            " 3.00  6.00  6.00\n"
            "4 frames, 5 missing between them: 1, 3, 5..7\n");
  ArrivalStatistics frameless;
  frameless.add("a", {1, 1, 1}, std::nullopt);
  EXPECT_EQ(test::line_count(frameless.text()), 2);
  frameless.add("a", {1, 1, 1}, 7);
  EXPECT_TRUE(frameless.text().ends_with("\n1 frame, none missing\n"));
}

TEST(ArrivalTable, ListsTwelveGapsAndSixtyFourWriters) {
  ArrivalStatistics statistics;
  for (std::uint64_t i = 0; i <= 13; ++i) {
    statistics.add("a", {std::int64_t(i), 0, 1}, 2 * i);
    if (i == 12) {
      EXPECT_TRUE(statistics.text().ends_with(": 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23\n"));
    }
  }
  EXPECT_TRUE(statistics.text().ends_with(" 21, 23, ..\n")) << statistics.text();
  for (int i = 1; i < 64; ++i) statistics.add("w" + std::to_string(i), {20, 0, 1}, {});
  EXPECT_EQ(statistics.text().find("others"), std::string::npos);
  for (const char* writer : {"x", "y", "a"}) statistics.add(writer, {30, 0, 1}, {});
  const std::string text = statistics.text();
  EXPECT_EQ(test::line_count(text), 1 + 64 + 2 + 1);
  EXPECT_NE(text.find("\nothers         2 "), std::string::npos) << text;
  EXPECT_NE(text.find("\na             15 "), std::string::npos) << text;
}

TEST(Arrivals, OneIntervalHasNoRateIfItIsZero) {
  const ArrivalSummary two = summary_of({{5, 3'000'000, 7}, {5, 1'000'000, 9}});
  EXPECT_TRUE(std::isnan(two.rate_hz));
  EXPECT_TRUE(std::isnan(two.bytes_per_s));
  EXPECT_EQ(two.interval_ms.max, 0);
  EXPECT_EQ(two.latency_ms.min, 1);
  EXPECT_EQ(two.latency_ms.median, 2);
  const ArrivalSummary later = summary_of({{5, 0, 7}, {500'000'005, 0, 9}});
  EXPECT_DOUBLE_EQ(later.rate_hz, 2);
  EXPECT_DOUBLE_EQ(later.bytes_per_s, 18);
}

TEST(Arrivals, TheQuantileIsThatOfTheNearestRank) {
  for (const auto& [count, rank] : {std::pair{1, 1}, {19, 19}, {20, 19}, {21, 20}, {40, 38}}) {
    std::vector<double> values;
    for (int i = 1; i <= count; ++i) values.push_back(i);
    EXPECT_EQ(quantiles_of(values).p95, rank) << count;
    EXPECT_EQ(quantiles_of(values).median, 0.5 * (count + 1)) << count;
  }
}

TEST(Arrivals, ANumberMoreThan24BelowTheNewestBeginsANewRun) {
  FrameGaps inside, outside;
  for (const std::uint64_t frame : {100, 76}) inside.add(frame);
  EXPECT_EQ(inside.missing_text(9), "77..99");
  EXPECT_EQ(inside.missing(), 23u);
  for (const std::uint64_t frame : {100, 75}) outside.add(frame);
  EXPECT_EQ(outside.missing(), 0u);
  EXPECT_EQ(outside.frames(), 2u);
}

// 10,001 ranges: the oldest is forgotten, and its frames and the gap after it still count.
TEST(Arrivals, TheOldestOfMoreThanTenThousandRangesIsForgotten) {
  FrameGaps gaps;
  gaps.add(100);
  gaps.add(101);
  for (std::uint64_t i = 0; i < 9'999; ++i) gaps.add(105 + 3 * i);
  EXPECT_TRUE(gaps.missing_text(2).starts_with("102..104, 106..107, "));
  gaps.add(105 + 3 * 9'999);
  EXPECT_TRUE(gaps.missing_text(1).starts_with("106..107, "));
  EXPECT_EQ(gaps.frames(), 2u + 10'000);
  EXPECT_EQ(gaps.missing(), 3u + 2 * 9'999);
  const std::uint64_t last = 105 + 3 * 9'999;
  for (const std::uint64_t frame : {last - 2, last - 1, last - 4}) gaps.add(frame);  // one less
  gaps.add(20);
  EXPECT_TRUE(gaps.missing_text(1).starts_with("106..107, "));
  gaps.add(50);
  EXPECT_TRUE(gaps.missing_text(1).starts_with("109..110, "));
  EXPECT_EQ(gaps.frames(), 2u + 10'000 + 3 + 2);
  EXPECT_EQ(gaps.missing(), 3u + 2 * 9'999 - 3 + 29);
}

TEST(Arrivals, AreRemovedBeforeAStamp) {
  ArrivalStatistics statistics;
  for (const std::int64_t stamp_ns : {10, 20, 30}) statistics.add("a", {stamp_ns, 0, 1}, {});
  statistics.remove_before(20);
  EXPECT_EQ(statistics.messages(), 2u);
  EXPECT_NE(statistics.text().find("\na              2 "), std::string::npos);
  statistics.remove_before(31);
  EXPECT_EQ(statistics.messages(), 0u);
}

TEST(TopicTables, ListTypesQosAndEndpoints) {
  ListedTopic tile{
      "v/HullTile",       {"A", "B"}, {}, {{"recon_a", 1}, {"recon_b", 2}, {"recon_c", 1}},
      {{"rendering", 1}}, 5};
  const ListedTopic state{"v/State", {"S"}, {"reliable"}, {}, {}, 12};
  EXPECT_EQ(topics_text({tile, state}, false),
            "topic       type   QoS       writers      readers\n"
            "v/HullTile  A / B  -         recon_a,     rendering\n"
            "                             recon_b x2,\n"
            "                             recon_c\n"
            "v/State     S      reliable  -            -\n");
  EXPECT_EQ(topics_text({tile, state}, true),
            "topic       type   QoS       writers               messages\n"
            "v/HullTile  A / B  -         recon_a, recon_b x2,         5\n"
            "                             recon_c\n"
            "v/State     S      reliable  -                           12\n");
  EXPECT_EQ(nodes_text({tile, state}, false),
            "node       writes       reads\n"
            "recon_a    HullTile     -\n"
            "recon_b    HullTile x2  -\n"
            "recon_c    HullTile     -\n"
            "rendering  -            HullTile\n");
}

// In a terminal with 120 columns.
TEST(TopicTables, ListsBreakAt15And24And48Columns) {
  const auto topic = [](std::size_t width) {
    const std::string first(5, 'a'), second(width - 7, 'b');
    return ListedTopic{"v/" + second, {"A"}, {}, {{first, 1}, {second, 1}}, {}, 0};
  };
  EXPECT_EQ(test::line_count(topics_text({topic(15)}, false)), 2);
  EXPECT_EQ(test::line_count(topics_text({topic(16)}, false)), 3);
  EXPECT_EQ(test::line_count(topics_text({topic(24)}, true)), 2);
  EXPECT_EQ(test::line_count(topics_text({topic(25)}, true)), 3);
  ListedTopic read = topic(15);
  std::swap(read.readers, read.writers);
  EXPECT_EQ(test::line_count(topics_text({read}, false)), 2);
  read.readers = topic(16).writers;
  EXPECT_EQ(test::line_count(topics_text({read}, false)), 3);
  for (const bool reads : {false, true})
    for (const std::size_t width : {48, 49}) {
      std::vector<ListedTopic> topics{{"v/aaaaa", {"A"}, {}, {}, {}, 0},
                                      {"v/" + std::string(width - 7, 'b'), {"A"}, {}, {}, {}, 0}};
      for (ListedTopic& one : topics) (reads ? one.readers : one.writers)["sim"] = 1;
      EXPECT_EQ(test::line_count(nodes_text(topics, false)), width == 48 ? 2 : 3);
    }
}

}  // namespace
}  // namespace fivepipe::launch
