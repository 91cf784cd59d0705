#include "launch/supervise/status/status_messages.h"

#include <gtest/gtest.h>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"
#include "tests/support/time_units.h"

using namespace fivepipe;
using namespace std::chrono_literals;

// One that starts in the future is the node like any other: the clock of its host may have been set
// back since.
TEST(StatusMessages, AProcessWithAnImpossibleStartIsIgnored) {
  bus::Bus bus({test::own_domain()});
  auto writer = bus.writer<bus::topics::NodeStatus>();
  auto reader = bus.reader<bus::topics::NodeStatus>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 1; }));
  launch::StatusRegistry registry;
  const std::int64_t now_ns = base::now_realtime_ns(), hour_ns = 3600'000'000'000;
  const auto take = [&](std::int64_t start_stamp_ns) {
    fivepipe_v1_NodeStatus message{};
    messages::set_text(message.node, "sim");
    message.start_stamp_ns = start_stamp_ns;
    writer.write(message);
    const std::uint64_t ignored = registry.ignored();
    return test::eventually(bus, 10s, [&] {
      launch::take_statuses(reader, registry);
      return registry.ignored() > ignored ||
             (registry.newest("sim") && registry.newest("sim")->start_stamp_ns == start_stamp_ns);
    });
  };
  for (const std::int64_t wrong_ns :
       {std::int64_t(INT64_MAX), std::int64_t(-1), std::int64_t(INT64_MIN)})
    EXPECT_TRUE(take(wrong_ns)) << wrong_ns;
  EXPECT_EQ(registry.ignored(), 3u);
  EXPECT_FALSE(registry.newest("sim"));
  for (const std::int64_t start_ns : {now_ns + hour_ns, now_ns}) {
    EXPECT_TRUE(take(start_ns));
    ASSERT_TRUE(registry.newest("sim"));
    EXPECT_EQ(registry.newest("sim")->start_stamp_ns, start_ns);
  }
  EXPECT_EQ(registry.ignored(), 3u);
}

TEST(StatusMessages, EveryFieldOfAMessageIsKept) {
  fivepipe_v1_NodeStatus message{};
  messages::set_text(message.node, "sim");
  messages::set_text(message.version, "0.1.0");
  messages::set_text(message.gl_renderer, "llvmpipe");
  message.start_stamp_ns = 11;
  message.has_handled_frame = message.final_report = true;
  message.frame = 12;
  message.frame_rate_hz = 13.5;
  message.cpu_s = 14.5;
  message.memory_mb = 15.5;
  std::vector<fivepipe_v1_NamedCount> counts{{"frames", 3}, {"frames", 4}};
  std::vector<fivepipe_v1_DropCount> drops{{"bad_map", "wall1", "wrong size", 5},
                                           {"bad_map", "wall1", "wrong size", 6},
                                           {"lost", "b", "", 100}};
  std::vector<fivepipe_v1_TopicCounts> topics{
      {"a", 1, 2, 3, 4, 0}, {"b", 6, 0, 8, 9, 1}, {"c", 5, 1, 0, 0, 0}};
  std::vector<fivepipe_v1_EmptyCameraCount> cameras{{"left", 17}};
  std::vector<fivepipe_v1_ObjectCollisionCounts> collisions{{"ball", 18, 19, 20}};
  std::vector<fivepipe_v1_LatencySummary> latencies{{"draw", 1.5, 2.5, 3.5, 4.5, 21}};
  std::vector<fivepipe_v1_Diagnostic> diagnostics{{"hull", "empty"}};
  messages::borrow(message.counts, counts);
  messages::borrow(message.drops, drops);
  messages::borrow(message.topics, topics);
  messages::borrow(message.empty_cameras, cameras);
  messages::borrow(message.collisions, collisions);
  messages::borrow(message.latencies, latencies);
  messages::borrow(message.diagnostics, diagnostics);
  const bus::ProcessId process{"alpha", 1, 2};
  const launch::ProcessStatus status = launch::status_from(message, process);
  EXPECT_EQ(status.node, "sim");
  EXPECT_EQ(status.process, process);
  EXPECT_EQ(status.version, "0.1.0");
  EXPECT_EQ(status.gl_renderer, "llvmpipe");
  EXPECT_EQ(status.start_stamp_ns, 11);
  EXPECT_TRUE(status.has_handled_frame);
  EXPECT_TRUE(status.final_report);
  EXPECT_EQ(status.frame, 12u);
  EXPECT_EQ(status.frame_rate_hz, 13.5);
  EXPECT_EQ(status.cpu_s, 14.5);
  EXPECT_EQ(status.memory_mb, 15.5);
  using Counts = std::map<std::string, std::uint64_t>;
  EXPECT_EQ(status.counts, (Counts{{"frames", 7}}));
  EXPECT_EQ(status.drops, (Counts{{"bad_map: wall1: wrong size", 11},
                                  {"lost: b", 101},
                                  {"not_sent: a", 2},
                                  {"not_sent: c", 1}}));
  EXPECT_EQ(status.empty_cameras, (Counts{{"left", 17}}));
  const launch::TopicTotals &a = status.topics.at("a"), &b = status.topics.at("b");
  EXPECT_EQ((std::vector{a.sent, a.not_sent, a.received, a.recorded, a.lost}),
            (std::vector<std::uint64_t>{1, 2, 3, 4, 0}));
  EXPECT_EQ(b.lost, 1u);
  const launch::CollisionTotals& ball = status.collisions.at("ball");
  EXPECT_EQ((std::vector{ball.frames, ball.points, ball.first_contacts}),
            (std::vector<std::uint64_t>{18, 19, 20}));
  const launch::Latency& draw = status.latencies.at("draw");
  EXPECT_EQ((std::vector{draw.p50_ms, draw.p95_ms, draw.p99_ms, draw.max_ms}),
            (std::vector{1.5, 2.5, 3.5, 4.5}));
  EXPECT_EQ(draw.count, 21u);
  EXPECT_EQ(status.diagnostics, std::vector<std::string>{"hull: empty"});
}

TEST(StatusMessages, TheFirst256EntriesOfAListAreUsed) {
  fivepipe_v1_NodeStatus message{};
  std::vector<fivepipe_v1_NamedCount> counts(257);
  for (std::size_t i = 0; i < counts.size(); ++i)
    messages::set_text(counts[i].name, "count " + std::to_string(i));
  messages::borrow(message.counts, counts);
  const launch::ProcessStatus status = launch::status_from(message, std::nullopt);
  EXPECT_EQ(status.counts.size(), 256u);
  EXPECT_FALSE(status.counts.contains("count 256"));
  EXPECT_FALSE(status.process);
}

// Ends of writers are no statuses.
TEST(StatusMessages, AreTakenOfTheGivenNodes) {
  bus::Bus bus({test::own_domain()});
  auto reader = bus.reader<bus::topics::NodeStatus>();
  const std::int64_t now_ns = base::now_realtime_ns();
  {
    auto writer = bus.writer<bus::topics::NodeStatus>();
    ASSERT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 1; }));
    for (const auto& [node, start_stamp_ns] :
         std::vector<std::pair<std::string, std::int64_t>>{{"soon", now_ns + 45 * test::s},
                                                           {"other", now_ns},
                                                           {"never", INT64_MAX},
                                                           {"", now_ns}}) {
      fivepipe_v1_NodeStatus message{};
      messages::set_text(message.node, node);
      message.start_stamp_ns = start_stamp_ns;
      writer.write(message);
    }
  }
  launch::StatusRegistry registry;
  const std::set<std::string> nodes{"soon", "never", "last"};
  auto last = bus.writer<bus::topics::NodeStatus>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 1; }));
  fivepipe_v1_NodeStatus message{};
  messages::set_text(message.node, "last");
  message.start_stamp_ns = 0;
  last.write(message);
  ASSERT_TRUE(test::eventually(bus, 10s, [&] {
    launch::take_statuses(reader, registry, nodes);
    return registry.newest("last") != nullptr;
  }));
  EXPECT_EQ(registry.newest("last")->process, bus::this_process());
  ASSERT_TRUE(registry.newest("soon"));
  EXPECT_EQ(registry.processes()["soon"].size(), 1u) << "the end of its writer is no status";
  EXPECT_EQ(registry.processes().size(), 2u);
  EXPECT_EQ(registry.ignored(), 1u) << "the impossible start";
  EXPECT_LT(registry.activity("last", launch::arrival_clock_ns())->silent_s, 60);
}
