#include "common/pipeline/node/replay_monitor.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <set>
#include <string>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/not_finite.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::node {
namespace {

using namespace std::chrono_literals;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Sends the session and waits until the monitor reports it.
bool begins_by(bus::Bus& bus, bus::Writer<bus::topics::ReplaySession>& writer,
               ReplayMonitor& monitor, const char* name) {
  fivepipe_v1_ReplaySession session{};
  messages::set_text(session.replay, name);
  session.lossless = true;
  writer.write(session);
  return test::eventually(bus, 10s, [&] { return monitor.update(); });
}

TEST(ReplayMonitor, ReportsEachBeginningAndTheEndOfAReplay) {
  bus::Bus bus({test::own_domain()});
  NodeStatusReporter status(bus, "node");
  ReplayMonitor monitor(bus, status);
  EXPECT_FALSE(monitor.replaying());
  EXPECT_FALSE(monitor.lossless());
  EXPECT_FALSE(monitor.update());
  EXPECT_FALSE(monitor.replaying());
  auto writer = std::make_optional(bus.writer<bus::topics::ReplaySession>());
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer->readers() == 1; }));
  fivepipe_v1_ReplaySession session{};
  messages::set_text(session.replay, "replay");
  for (const bool lossless : {true, false, true}) {
    session.lossless = lossless;
    writer->write(session);
    EXPECT_TRUE(test::eventually(bus, 10s, [&] { return monitor.update(); }));
    EXPECT_TRUE(monitor.replaying());
    EXPECT_EQ(monitor.lossless(), lossless);
    EXPECT_FALSE(monitor.update()) << "reports a beginning once";
    EXPECT_TRUE(monitor.replaying());
    EXPECT_EQ(monitor.lossless(), lossless);
  }
  writer.reset();
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    EXPECT_FALSE(monitor.update()) << "the end is no beginning";
    return !monitor.replaying();
  }));
  EXPECT_FALSE(monitor.lossless());
}

TEST(ReplayMonitor, KnowsWhatArrivedBeforeTheReplay) {
  using Spacing = bus::topics::ObjectSpacing;
  bus::Bus bus({test::own_domain()});
  NodeStatusReporter status(bus, "node");
  ReplayMonitor monitor(bus, status);
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
  }
}

TEST(ReplayMonitor, RefusesASessionWithoutANameOrWithAnImpossibleRate) {
  bus::Bus bus({test::own_domain()});
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  NodeStatusReporter status(bus, "node");
  ReplayMonitor monitor(bus, status);
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
    EXPECT_FALSE(monitor.update());
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
  ReplayMonitor monitor(bus, status);
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
