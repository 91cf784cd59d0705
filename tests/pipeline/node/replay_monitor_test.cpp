#include "common/pipeline/node/replay_monitor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/not_finite.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::node {
namespace {

using namespace std::chrono_literals;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct CountingMonitor : ReplayMonitor {
  CountingMonitor(bus::Bus& bus, NodeStatusReporter& status)
      : ReplayMonitor(bus, status, [this] { ++begun; }) {}
  // Returns whether a replay has begun since the last call.
  bool has_begun() {
    update();
    return std::exchange(begun, 0) > 0;
  }
  int begun = 0;
};

// Sends the session and waits until the monitor reports it.
bool begins_by(bus::Bus& bus, bus::Writer<bus::topics::ReplaySession>& writer,
               CountingMonitor& monitor, const char* name) {
  fivepipe_v1_ReplaySession session{};
  messages::set_text(session.replay, name);
  session.lossless = true;
  writer.write(session);
  return test::eventually(bus, 10s, [&] { return monitor.has_begun(); });
}

TEST(ReplayMonitor, ReportsEachBeginningAndTheEndOfAReplay) {
  bus::Bus bus({test::own_domain()});
  NodeStatusReporter status(bus, "node");
  CountingMonitor monitor(bus, status);
  EXPECT_FALSE(monitor.replaying());
  EXPECT_FALSE(monitor.lossless());
  EXPECT_FALSE(monitor.has_begun());
  EXPECT_FALSE(monitor.replaying());
  auto writer = std::make_optional(bus.writer<bus::topics::ReplaySession>());
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer->readers() == 1; }));
  fivepipe_v1_ReplaySession session{};
  messages::set_text(session.replay, "replay");
  for (const bool lossless : {true, false, true}) {
    session.lossless = lossless;
    writer->write(session);
    EXPECT_TRUE(test::eventually(bus, 10s, [&] { return monitor.has_begun(); }));
    EXPECT_TRUE(monitor.replaying());
    EXPECT_EQ(monitor.lossless(), lossless);
    EXPECT_FALSE(monitor.has_begun()) << "reports a beginning once";
    EXPECT_TRUE(monitor.replaying());
    EXPECT_EQ(monitor.lossless(), lossless);
  }
  writer.reset();
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    EXPECT_FALSE(monitor.has_begun()) << "the end is no beginning";
    return !monitor.replaying();
  }));
  EXPECT_FALSE(monitor.lossless());
}

TEST(ReplayMonitor, ComparesArrivalsWithThatOfTheSession) {
  using Spacing = bus::topics::ObjectSpacing;
  bus::Bus bus({test::own_domain()});
  NodeStatusReporter status(bus, "node");
  CountingMonitor monitor(bus, status);
  auto sessions = bus.writer<bus::topics::ReplaySession>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return sessions.readers() == 1; }));
  const Spacing::Message message{};
  const auto arrived = [&](std::int64_t arrived_ns) {
    return bus::Sample<Spacing>(&message, {true, false, 0, 0, arrived_ns});
  };
  EXPECT_FALSE(monitor.precedes_replay(arrived(0))) << "no replay";
  for (int replay = 0; replay < 2; ++replay) {
    const std::int64_t before_ns = base::now_realtime_ns();
    ASSERT_TRUE(begins_by(bus, sessions, monitor, "replay"));
    EXPECT_TRUE(monitor.precedes_replay(arrived(before_ns - 1)));
    EXPECT_FALSE(monitor.precedes_replay(arrived(base::now_realtime_ns() + 1)));
    EXPECT_FALSE(monitor.precedes_replay(arrived(before_ns - 1), before_ns))
        << "the clock was set back behind the beginning";
  }
}

// A node that was busy finds messages from before a replay, its session and its first message
// together. It must discard its state before it handles the last one, and not handle the first one.
// A process receives its own messages during write().
TEST(ReplayMonitor, DiscardsEarlierMessagesThatArriveWithTheSession) {
  using Spacing = bus::topics::ObjectSpacing;
  bus::Bus bus({test::own_domain()});
  NodeStatusReporter status(bus, "node");
  std::vector<std::string> done;
  ReplayMonitor monitor(bus, status, [&] { done.push_back("discarded"); });
  auto reader = bus.reader<Spacing>();
  auto sessions = bus.writer<bus::topics::ReplaySession>();
  auto spacings = bus.writer<Spacing>();
  ASSERT_TRUE(test::eventually(bus, 10s,
                               [&] { return sessions.readers() == 1 && spacings.readers() == 1; }));
  const auto send = [&](const char* object) {
    Spacing::Message message{};
    messages::set_text(message.object, object);
    spacings.write(message);
  };
  const auto begin = [&](const char* name) {
    fivepipe_v1_ReplaySession session{};
    messages::set_text(session.replay, name);
    sessions.write(session);
  };
  const auto take = [&] {
    return monitor.take(reader, [&](const auto& sample) { done.push_back(sample->object); });
  };
  const auto expect = [&](std::size_t taken, const std::vector<std::string>& expected) {
    EXPECT_EQ(take(), taken);
    // DDS orders the messages of a take() by key.
    if (!done.empty()) std::sort(done.begin() + 1, done.end());
    EXPECT_EQ(std::exchange(done, {}), expected);
  };
  send("live");
  expect(1, {"live"});
  send("before");
  begin("first");
  send("of the first");
  expect(2, {"discarded", "of the first"});
  send("more of the first");
  begin("second");
  send("of the second");
  send("more of the second");
  expect(3, {"discarded", "more of the second", "of the second"});
  expect(0, {});
}

// Between two polls a replay has begun and ended, or two have begun. DDS returns the newest session
// first, because it orders the names by their first messages.
TEST(ReplayMonitor, OfSeveralSessionsAtOnceTheNewestCounts) {
  bus::Bus bus({test::own_domain()});
  NodeStatusReporter status(bus, "node");
  CountingMonitor monitor(bus, status);
  auto writer = std::make_optional(bus.writer<bus::topics::ReplaySession>());
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer->readers() == 1; }));
  const auto begin = [&](const char* name, bool lossless) {
    fivepipe_v1_ReplaySession session{};
    messages::set_text(session.replay, name);
    session.lossless = lossless;
    writer->write(session);
  };
  for (const auto& [newest, other] : {std::pair("a", "b"), {"b", "a"}}) {
    begin(newest, false);
    begin(other, false);
    begin(newest, true);
    EXPECT_TRUE(monitor.has_begun());
    EXPECT_TRUE(monitor.lossless()) << newest;
  }
  begin("short", false);
  writer.reset();
  EXPECT_TRUE(monitor.has_begun());
  EXPECT_FALSE(monitor.replaying());
}

TEST(ReplayMonitor, RefusesASessionWithoutANameOrWithAnImpossibleRate) {
  bus::Bus bus({test::own_domain()});
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  NodeStatusReporter status(bus, "node");
  CountingMonitor monitor(bus, status);
  auto writer = bus.writer<bus::topics::ReplaySession>();
  auto forged = std::make_optional(bus.writer<bus::topics::ReplaySession>());
  ASSERT_TRUE(
      test::eventually(bus, 10s, [&] { return writer.readers() == 1 && forged->readers() == 1; }));
  ASSERT_TRUE(begins_by(bus, writer, monitor, "replay"));
  std::uint64_t refused = 0;
  const auto send = [&](const char* name, double rate) {
    fivepipe_v1_ReplaySession session{};
    messages::set_text(session.replay, name);
    session.rate = rate;
    forged->write(session);
    ++refused;
  };
  for (const double rate : {test::kNaN, -1.0, -1e-300, kInfinity, -kInfinity})
    for (const char* name : {"replay", "other"}) send(name, rate);
  send("", 1);
  const auto expect_still_as_before = [&] {
    EXPECT_FALSE(monitor.has_begun());
    EXPECT_TRUE(monitor.replaying());
    EXPECT_TRUE(monitor.lossless());
  };
  std::uint64_t counted = 0;
  std::set<std::string> details;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    expect_still_as_before();
    for (const auto& sample : statuses.take()) {
      if (!sample.valid()) continue;
      counted = 0;
      for (const auto& drop : messages::span_of(sample->drops))
        if (drop.reason == std::string("bad_replay")) {
          counted += drop.count;
          details.insert(drop.detail);
        }
    }
    return counted == refused;
  })) << counted;
  EXPECT_TRUE(details.contains("no name"));
  EXPECT_TRUE(details.contains("impossible rate -1e-300: must be finite and at least 0"));
  // The end of a refused session is not the end of the replay.
  forged.reset();
  ASSERT_FALSE(test::eventually(bus, 300ms, [&] {
    expect_still_as_before();
    return HasFailure();
  }));
}

// A replay that ends after another has begun.
TEST(ReplayMonitor, OnlyTheEndOfTheNewestReplayCounts) {
  bus::Bus bus({test::own_domain()});
  NodeStatusReporter status(bus, "node");
  CountingMonitor monitor(bus, status);
  auto first = std::make_optional(bus.writer<bus::topics::ReplaySession>());
  auto second = std::make_optional(bus.writer<bus::topics::ReplaySession>());
  ASSERT_TRUE(
      test::eventually(bus, 10s, [&] { return first->readers() == 1 && second->readers() == 1; }));
  ASSERT_TRUE(begins_by(bus, *first, monitor, "first"));
  ASSERT_TRUE(begins_by(bus, *second, monitor, "second"));
  first.reset();
  EXPECT_FALSE(test::eventually(bus, 300ms, [&] {
    monitor.update();
    return !monitor.lossless();
  }));
  second.reset();
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    monitor.update();
    return !monitor.replaying();
  }));
}

}  // namespace
}  // namespace fivepipe::node
