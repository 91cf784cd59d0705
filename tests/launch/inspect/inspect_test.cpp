// The parts of `fivepipe info`, `ls`, `echo` and `hz`, without DDS and files.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>

#include "common/base/text_table.h"
#include "common/base/timestamp_text.h"
#include "launch/inspect/arrival_statistics.h"
#include "launch/inspect/message_formatter.h"
#include "launch/inspect/topic_list.h"
#include "launch/inspect/topic_resolver.h"

namespace fivepipe::launch {
namespace {

std::string usage_error(const std::function<void()>& run) {
  try {
    run();
  } catch (const base::UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(TopicChoice, ResolvesNameBaseNameOrUniqueMatch) {
  const std::vector<std::string> topics{"a/HullTile", "a/HullComponents", "a/HeadPose",
                                        "b/HullTile/more", "a/Hull"};
  EXPECT_EQ(resolve_topic("a/HullTile", topics), "a/HullTile");
  // A base name takes precedence over a regular expression, which would match b/HullTile/more too.
  EXPECT_EQ(resolve_topic("HullTile", topics), "a/HullTile");
  EXPECT_EQ(resolve_topic("Hull", topics), "a/Hull");
  EXPECT_EQ(resolve_topic("hullc", topics), "a/HullComponents");
  EXPECT_EQ(resolve_topic("^b/", topics), "b/HullTile/more");
}

TEST(TopicChoice, RejectsAmbiguousOrUnknownAndListsTopics) {
  const std::vector<std::string> topics{"a/HullTile", "a/HullComponents", "a/HeadPose"};
  const std::string several = usage_error([&] { resolve_topic("hull", topics); });
  EXPECT_NE(several.find("a/HullTile, a/HullComponents"), std::string::npos) << several;
  EXPECT_EQ(several.find("HeadPose"), std::string::npos) << several;
  const std::string none = usage_error([&] { resolve_topic("Foot", topics); });
  EXPECT_NE(none.find("a/HeadPose"), std::string::npos) << none;
  EXPECT_NE(usage_error([&] { resolve_topic("(", topics); }).find("regular expression"),
            std::string::npos);
  EXPECT_NE(usage_error([&] { resolve_topic("x", {}); }), "");
}

TEST(TopicChoice, ErrorsListTheTopics) {
  const std::vector<std::string> topics{"a/HullTile", "a/HullComponents", "a/HeadPose"};
  EXPECT_EQ(usage_error([&] { resolve_topic("hull", topics); }),
            "'hull' matches several topics:\n  a/HullTile, a/HullComponents");
  EXPECT_EQ(usage_error([&] { resolve_topic("Foot", topics); }),
            "no topic 'Foot'; the topics are:\n  a/HullTile, a/HullComponents, a/HeadPose");
  EXPECT_EQ(usage_error([&] { resolve_topic("x", {}); }), "no topic 'x'; there are no topics");
  EXPECT_TRUE(usage_error([&] {
                resolve_topic("(", topics);
              }).starts_with("'(' is neither a topic nor a regular expression ("));
  EXPECT_EQ(base_name("a/b/c"), "c");
  EXPECT_EQ(base_name("c"), "c");
}

TEST(TextTable, WrapsLongCells) {
  base::TextTable table({{"name"}, {"n", true}, {"writers", false, 10}});
  table.add({"a", "5", "one, two, three"});
  table.add({"b", "1234", "x"});
  EXPECT_EQ(table.text(),
            "name     n  writers\n"
            "a        5  one, two,\n"
            "            three\n"
            "b     1234  x\n");
}

TEST(StampText, ShowsMicrosecondsBeforeAndAfter1970) {
  setenv("TZ", "UTC", 1);
  tzset();
  EXPECT_EQ(base::local_date_and_time(1'000'000'000'123'456'789),
            "2001-09-09 01:46:40.123456 +0000");
  EXPECT_EQ(base::local_time_of_day(-1'000), "23:59:59.999999");
}

const schema::Idl& made_up_idl() {
  static const schema::Idl idl = schema::parse_idl(R"(module m {
    struct Point { double x; double y; };
    struct Thing { @key string name; unsigned long long frame; @key unsigned short part;
      Point p; sequence<Point> points; sequence<octet> raw; };
  };)");
  return idl;
}

// Little-endian CDR.
struct Cdr {
  std::vector<std::byte> bytes{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  template <class T>
  Cdr& put(T value) {
    while ((bytes.size() - 4) % sizeof(T)) bytes.push_back(std::byte{0});
    const auto* raw = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), raw, raw + sizeof(T));
    return *this;
  }
  Cdr& put(const std::string& text) {
    put(std::uint32_t(text.size() + 1));
    for (const char c : text) put(c);
    return put('\0');
  }
};

std::vector<std::byte> thing() {
  Cdr cdr;
  cdr.put(std::string("ball"))
      .put(std::uint64_t(12))
      .put(std::uint16_t(3))
      .put(1.5)
      .put(std::nan(""));
  cdr.put(std::uint32_t(2)).put(1.0).put(2.0).put(3.0).put(4.0).put(std::uint32_t(20));
  for (int i = 0; i < 20; ++i) cdr.put(std::uint8_t(i));
  return cdr.bytes;
}
ShownMessage shown(std::span<const std::byte> cdr) {
  return {"t/Thing", "node_a", 1'000'000'000, 1'002'500'000, std::nullopt, cdr};
}

std::string text_of_thing(const TextOptions& options) {
  const auto cdr = thing();
  return MessageFormatter(made_up_idl(), "m::Thing", options)(shown(cdr));
}

TEST(MessageFormatter, PrintsAYamlDocumentWithTimeWriterAndLatency) {
  setenv("TZ", "UTC", 1);
  tzset();
  EXPECT_EQ(text_of_thing({}),
            "---  # 00:00:01.000000 node_a, latency 2.50 ms\n"
            "name: ball\nframe: 12\npart: 3\np: {x: 1.5, y: .nan}\npoints:\n  - {x: 1.0, y: 2.0}\n "
            " - {x: 3.0, y: 4.0}\nraw: {sequence<octet>: 20}\n");
  EXPECT_NE(text_of_thing({.full = true}).find("raw: [0, 1, 2,"), std::string::npos);
}

TEST(MessageFormatter, PrintsExactFloatsWithoutTimes) {
  EXPECT_EQ(
      text_of_thing({.json = true, .hex = true, .bare = true}),
      "{\"name\":\"ball\",\"frame\":12,\"part\":3,\"p\":{\"x\":\"0x1.8p+0\",\"y\":\"nan\"},"
      "\"points\":[{\"x\":\"0x1p+0\",\"y\":\"0x1p+1\"},{\"x\":\"0x1.8p+1\",\"y\":\"0x1p+2\"}],"
      "\"raw\":{\"sequence<octet>\":20}}\n");
  const std::string yaml = text_of_thing({.hex = true, .bare = true});
  EXPECT_TRUE(yaml.starts_with("---\nname: ball\n")) << yaml;
  EXPECT_NE(yaml.find("p: {x: \"0x1.8p+0\", y: nan}"), std::string::npos) << yaml;
}

TEST(MessageFormatter, ShowsOneField) {
  const auto field = [](const char* path, bool json = false) {
    return text_of_thing({.json = json, .field = FieldPath(path)});
  };
  EXPECT_EQ(field("frame"), "--- 12  # 00:00:01.000000 node_a, latency 2.50 ms\n");
  EXPECT_EQ(field("points[1].y").substr(0, 7), "--- 4.0");
  EXPECT_EQ(field("points[2].y").substr(0, 8), "--- null");
  EXPECT_EQ(field("raw[19]").substr(0, 6), "--- 19");
  EXPECT_EQ(field("p.y", true),
            "{\"topic\":\"t/"
            "Thing\",\"writer\":\"node_a\",\"source_stamp_ns\":1000000000,\"log_stamp_ns\":"
            "1002500000,\"value\":\"NaN\"}\n");
  EXPECT_NE(usage_error([&] { field("p.z"); }).find("the fields are: x, y"), std::string::npos);
  EXPECT_NE(usage_error([&] { field("frame.x"); }), "");
  EXPECT_NE(usage_error([&] { field("points.x"); }).find("[0]"), std::string::npos);
  for (const char* bad : {"", ".", "a.", ".a", "a[", "a[]", "a[x]", "a[1", "[1]", "a[1]b", "a b",
                          "a..b", "a[-1]", "a[99999999999999999999]"})
    EXPECT_NE(usage_error([&] { FieldPath path(bad); }), "") << bad;
  for (const char* good : {"a", "a.b", "a[1]", "a[1][2].b", "a[0].b[3]"})
    EXPECT_EQ(usage_error([&] { FieldPath path(good); }), "") << good;
}

TEST(MessageFormatter, PrintsTheKeyOfAKeyChange) {
  Cdr key;
  key.put(std::string("ball")).put(std::uint16_t(3));
  ShownMessage message = shown(key.bytes);
  message.key_change = recording::KeyChange::disposed;
  for (const int representation : {1, 7}) {
    key.bytes[1] = std::byte(representation);
    const std::string text = MessageFormatter(made_up_idl(), "m::Thing", {})(message);
    EXPECT_NE(text.find("\nkey_change: disposed\nkey: {name: ball, part: 3}\n"), std::string::npos)
        << text;
  }
  const std::string json = MessageFormatter(made_up_idl(), "m::Thing", {.json = true})(message);
  EXPECT_NE(json.find("\"key_change\":\"disposed\",\"key\":{\"name\":\"ball\",\"part\":3}"),
            std::string::npos);
}

TEST(MessageFormatter, AbbreviatesSequencesOfMoreThanSixteenNumbers) {
  const schema::Idl idl = schema::parse_idl("struct S { sequence<octet> a; };");
  const auto shown_of = [&](std::uint32_t count, const TextOptions& options) {
    Cdr cdr;
    cdr.put(count);
    for (std::uint32_t i = 0; i < count; ++i) cdr.put(std::uint8_t(1));
    return MessageFormatter(idl, "S", options)(shown(cdr.bytes));
  };
  const std::string ones = "1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1";
  EXPECT_EQ(shown_of(16, {.bare = true}), "---\na: [" + ones + "]\n");
  EXPECT_EQ(shown_of(17, {.bare = true}), "---\na: {sequence<octet>: 17}\n");
  EXPECT_EQ(shown_of(17, {.full = true, .bare = true}), "---\na: [" + ones + ", 1]\n");
  EXPECT_EQ(shown_of(17, {.bare = true, .field = FieldPath("a")}), "---\nsequence<octet>: 17\n");
  EXPECT_EQ(shown_of(17, {.bare = true, .field = FieldPath("a[16]")}), "--- 1\n");
}

TEST(MessageFormatter, MarksAnUnknownWriterAndPayloadsThatItCannotDecode) {
  setenv("TZ", "UTC", 1);
  tzset();
  const std::array<std::byte, 5> cut{std::byte{0}, std::byte{1}};
  ShownMessage message = shown(cut);
  message.writer = "";
  const MessageFormatter yaml(made_up_idl(), "m::Thing", {}),
      json(made_up_idl(), "m::Thing", {.json = true}),
      bare(made_up_idl(), "m::Thing", {.json = true, .bare = true});
  const std::string text = yaml(message);
  EXPECT_TRUE(
      text.starts_with("---  # 00:00:01.000000 (unknown writer), latency 2.50 ms\nnot_decoded: "))
      << text;
  EXPECT_TRUE(text.ends_with("\nbytes: 5\n")) << text;
  EXPECT_TRUE(json(message).starts_with("{\"topic\":\"t/Thing\",\"writer\":\"\","))
      << json(message);
  EXPECT_TRUE(bare(message).starts_with("{\"error\":\"")) << bare(message);
  message.key_change = recording::KeyChange::unregistered;
  EXPECT_TRUE(yaml(message).starts_with(
      "---  # 00:00:01.000000 (unknown writer)\nkey_change: unregistered\nkey: "))
      << yaml(message);
  EXPECT_EQ(bare(message), "");
}

TEST(MessageFormatter, DecodesCdr2KeysWithFieldsOfUpToFourBytesInBothByteOrders) {
  const schema::Idl idl = schema::parse_idl(
      "enum E { zero, one, two }; struct K { @key unsigned long a; long long b; @key E e; };");
  for (const bool big_endian : {false, true}) {
    std::vector<std::byte> key(12);
    key[1] = std::byte(big_endian ? 6 : 7);
    key[big_endian ? 7 : 4] = std::byte{5};
    key[big_endian ? 11 : 8] = std::byte{2};
    ShownMessage message = shown(key);
    message.key_change = recording::KeyChange::disposed;
    const std::string text = MessageFormatter(idl, "K", {})(message);
    EXPECT_TRUE(text.ends_with("\nkey_change: disposed\nkey: {a: 5, e: two}\n")) << text;
  }
}

TEST(MessageFormatter, NamesTheFieldThatDoesNotExist) {
  const auto error = [](const char* path) {
    return usage_error([&] { text_of_thing({.field = FieldPath(path)}); });
  };
  EXPECT_EQ(error("p.z"), "--field p.z: no field z; the fields are: x, y");
  EXPECT_EQ(error("frame.x"), "--field frame.x: x needs a value with fields before it");
  EXPECT_EQ(error("points.x"),
            "--field points.x: x needs a value with fields before it; use [0], [1] .. for the "
            "elements of a sequence");
  EXPECT_EQ(error("frame[3]"), "--field frame[3]: [3] needs a sequence before it");
  EXPECT_EQ(usage_error([] { FieldPath path("a b"); }),
            "'a b' is not a field path; examples: frame, region.u0_px, objects[0].object");
}

TEST(MessageFormatter, DoesNotDecodeCdr2KeysWithFieldsOfEightBytes) {
  const schema::Idl idl =
      schema::parse_idl("struct Wide { @key octet a; @key unsigned long long b; };");
  Cdr key;
  key.put(std::uint8_t(1)).put(std::uint64_t(2));
  ShownMessage message = shown(key.bytes);
  message.key_change = recording::KeyChange::unregistered;
  EXPECT_NE(MessageFormatter(idl, "Wide", {})(message).find("key: {a: 1, b: 2}"),
            std::string::npos);
  key.bytes[1] = std::byte{7};
  EXPECT_NE(MessageFormatter(idl, "Wide", {})(message).find("key: \""), std::string::npos);
}

TEST(MessageFormatter, ReportsUndecodablePayload) {
  const auto cdr = thing();
  for (std::size_t bytes = 0; bytes < cdr.size(); ++bytes) {
    const ShownMessage cut = shown(std::span(cdr).first(bytes));
    EXPECT_NE(MessageFormatter(made_up_idl(), "m::Thing", {})(cut).find("not_decoded: "),
              std::string::npos)
        << bytes;
    EXPECT_NE(MessageFormatter(made_up_idl(), "m::Thing", {.json = true})(cut).find("\"error\":"),
              std::string::npos)
        << bytes;
  }
}

TEST(Arrivals, QuantilesDoNotDependOnTheOrder) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  const Quantiles spread = quantiles_of(values);
  EXPECT_EQ(spread.min, 1);
  EXPECT_EQ(spread.median, 50.5);
  EXPECT_EQ(spread.p95, 95);
  EXPECT_EQ(spread.max, 100);
  EXPECT_EQ(quantiles_of({7}).p95, 7);
  EXPECT_TRUE(std::isnan(quantiles_of({}).median));
}

TEST(Arrivals, RateCountsIntervals) {
  std::deque<Arrival> arrivals;
  for (int i = 0; i < 11; ++i)
    arrivals.push_back({1'000'000'000 + i * 100'000'000, 2'000'000 + i * 1'000'000, 1000});
  const ArrivalSummary summary = summary_of(arrivals);
  EXPECT_EQ(summary.messages, 11u);
  EXPECT_NEAR(summary.rate_hz, 10, 1e-9);
  EXPECT_NEAR(summary.bytes_per_s, 10'000, 1e-6);
  EXPECT_NEAR(summary.interval_ms.median, 100, 1e-9);
  EXPECT_NEAR(summary.latency_ms.max, 12, 1e-9);
  arrivals.resize(1);
  EXPECT_TRUE(std::isnan(summary_of(arrivals).rate_hz));
  EXPECT_EQ(summary_of({}).messages, 0u);
}

TEST(Arrivals, FindsMissingFramesInAnyOrder) {
  std::mt19937 random(7);
  for (int repeat = 0; repeat < 200; ++repeat) {
    std::vector<std::uint64_t> arrived;
    for (std::uint64_t frame = 50; frame < 150; ++frame)
      if (random() % 5) arrived.insert(arrived.end(), 1 + random() % 2, frame);
    if (arrived.empty()) continue;
    const std::set<std::uint64_t> distinct(arrived.begin(), arrived.end());
    // Shuffles groups of ten messages. They span fewer than 24 frames, the reorder window, except
    // with a probability of about 10^-7.
    for (std::size_t i = 0; i + 10 <= arrived.size(); i += 10)
      std::shuffle(arrived.begin() + std::ptrdiff_t(i), arrived.begin() + std::ptrdiff_t(i) + 10,
                   random);
    FrameGaps gaps;
    for (const std::uint64_t frame : arrived) gaps.add(frame);
    ASSERT_EQ(gaps.frames(), distinct.size());
    ASSERT_EQ(gaps.missing(), *distinct.rbegin() - *distinct.begin() + 1 - distinct.size());
  }
}

TEST(Arrivals, ListsGapsAndDetectsRestart) {
  FrameGaps gaps;
  for (const std::uint64_t frame : {1000, 1001, 1003, 1006, 0, 1, 2, 4}) gaps.add(frame);
  EXPECT_EQ(gaps.missing(), 4u);
  EXPECT_EQ(gaps.missing_text(12), "1002, 1004..1005, 3");
  EXPECT_EQ(gaps.missing_text(2), "1002, 1004..1005, ..");
  EXPECT_EQ(FrameGaps().missing(), 0u);
}

// A writer can send any frame numbers, and any number of processes can write.
TEST(Arrivals, AreBoundedAndStillCounted) {
  FrameGaps gaps;
  constexpr std::uint64_t kFrames = 3 * FrameGaps::kMaxRanges;
  for (std::uint64_t i = 0; i < kFrames; ++i) gaps.add(100 + 3 * i);
  EXPECT_EQ(gaps.frames(), kFrames);
  EXPECT_EQ(gaps.missing(), 2 * (kFrames - 1));
  EXPECT_EQ(gaps.missing_text(2 * FrameGaps::kMaxRanges).find("101..102"), std::string::npos)
      << "the oldest gap is forgotten";
  FrameGaps falling;  // each number begins a new run
  for (std::uint64_t i = 0; i < kFrames; ++i) falling.add(100 * (kFrames - i));
  EXPECT_EQ(falling.frames(), kFrames);
  EXPECT_EQ(falling.missing(), 0u);
  ArrivalStatistics statistics;
  for (int i = 0; i < 1000; ++i) statistics.add("writer_" + std::to_string(i), {i, 0, 1}, {});
  const std::string text = statistics.text();
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'),
            std::ptrdiff_t(ArrivalStatistics::kMaxWriters) + 4);
  EXPECT_NE(text.find("others"), std::string::npos) << text;
}

TEST(Arrivals, RemovesOldArrivalsButKeepsFrames) {
  ArrivalStatistics statistics;
  for (int i = 0; i < 10; ++i)
    statistics.add(i % 2 ? "odd" : "even", {i * 1'000'000, 0, 1}, i == 5 ? 6 : std::uint64_t(i));
  statistics.remove_before(8'000'000);
  EXPECT_EQ(statistics.messages(), 2u);
  EXPECT_NE(statistics.text().find("9 frames, 1 missing between them: 5\n"), std::string::npos)
      << statistics.text();
}

TEST(TopicList, ShortensQosAndSkipsOwnEndpoints) {
  EXPECT_EQ(short_qos({{"reliability", "reliable, blocks 100 ms"},
                       {"history", "keep_last 8"},
                       {"durability", "transient_local"}}),
            "reliable, last 8, latched");
  EXPECT_EQ(
      short_qos(
          {{"reliability", "best_effort"}, {"history", "keep_all"}, {"durability", "volatile"}}),
      "best_effort, all");
  EXPECT_EQ(short_qos({}), "");
  EXPECT_EQ(short_qos({{"durability", "persistent"}, {"history", "other"}}), "other, persistent");
  const std::vector<bus::EndpointDescription> endpoints{
      {"v/T", "T", true, false, "g1", "0123456789ab", "", "", {}},
      {"v/T", "T", true, false, "g2", "p2", "b", "", {}},
      {"v/T", "T", false, false, "g3", "p3", "b", "", {{"history", "keep_all"}}},
      {"v/T", "T", false, true, "g4", "p4", "me", "", {}},
      {"v/U", "U", true, true, "g5", "p4", "me", "", {}},
      {"v/T", "T", true, false, "g6", "p6", "b", "", {}}};
  const auto topics = topics_of(endpoints);
  ASSERT_EQ(topics.size(), 1u);
  EXPECT_EQ(topics[0].writers, (std::map<std::string, int>{{"(01234567)", 1}, {"b", 2}}));
  EXPECT_EQ(topics[0].readers, (std::map<std::string, int>{{"b", 1}}));
  EXPECT_EQ(topics[0].types, std::set<std::string>{"T"});
  EXPECT_EQ(topics[0].qos, std::set<std::string>{""}) << "that of the writers";
  EXPECT_EQ(topics_of(std::vector<bus::EndpointDescription>{
                {"v/T", "T", true, false, "", "", "", "", {}}})[0]
                .writers,
            (std::map<std::string, int>{{"?", 1}}));
  EXPECT_NE(topics_text(topics, false).find("b x2"), std::string::npos);
  EXPECT_EQ(nodes_text(topics, false),
            "node        writes  reads\n(01234567)  T       -\nb           T x2    T\n");
}

}  // namespace
}  // namespace fivepipe::launch
