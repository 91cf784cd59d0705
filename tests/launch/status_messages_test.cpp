#include "launch/supervise/status/status_messages.h"

#include <gtest/gtest.h>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

using namespace fivepipe;
using namespace std::chrono_literals;

// The process of a node that started last is the node. A peer that starts later than all others
// would be the node forever.
TEST(StatusMessages, AProcessThatStartsInTheFutureIsIgnored) {
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
       {now_ns + hour_ns, std::int64_t(INT64_MAX), std::int64_t(-1), std::int64_t(INT64_MIN)})
    EXPECT_TRUE(take(wrong_ns)) << wrong_ns;
  EXPECT_EQ(registry.ignored(), 4u);
  EXPECT_FALSE(registry.newest("sim"));
  EXPECT_TRUE(take(now_ns)) << "the real process";
  EXPECT_TRUE(registry.newest("sim"));
  EXPECT_EQ(registry.ignored(), 4u);
}
