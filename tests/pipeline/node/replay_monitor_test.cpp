#include "common/pipeline/node/replay_monitor.h"

#include <gtest/gtest.h>

#include <optional>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::node {
namespace {

using namespace std::chrono_literals;

TEST(ReplayMonitor, ReportsEachBeginningAndTheEndOfAReplay) {
  bus::Bus bus({test::own_domain()});
  ReplayMonitor monitor(bus);
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

}  // namespace
}  // namespace fivepipe::node
