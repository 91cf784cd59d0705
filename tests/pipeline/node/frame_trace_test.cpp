#include "common/pipeline/node/frame_trace.h"

#include <gtest/gtest.h>

#include <map>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::node {
namespace {

using namespace std::chrono_literals;

void wait_for_the_clock() {
  const std::int64_t start_ns = base::now_realtime_ns();
  while (base::now_realtime_ns() < start_ns + 1000) {
  }
}

TEST(FrameSteps, AreContiguousUntilTheEnd) {
  FrameSteps steps;
  steps.end();
  EXPECT_TRUE(steps.steps().empty());
  const std::int64_t before_ns = base::now_realtime_ns();
  steps.begin("first");
  wait_for_the_clock();
  steps.begin("second");
  wait_for_the_clock();
  steps.end();
  const std::int64_t after_ns = base::now_realtime_ns();
  wait_for_the_clock();
  steps.end();
  steps.begin("after a pause");
  ASSERT_EQ(steps.steps().size(), 3u);
  const FrameSteps::Step &first = steps.steps()[0], &second = steps.steps()[1],
                         &third = steps.steps()[2];
  EXPECT_EQ(first.name, "first");
  EXPECT_EQ(second.name, "second");
  EXPECT_GE(first.start_ns, before_ns);
  EXPECT_LT(first.start_ns, first.end_ns);
  EXPECT_EQ(first.end_ns, second.start_ns);
  EXPECT_LT(second.start_ns, second.end_ns);
  EXPECT_LE(second.end_ns, after_ns);
  EXPECT_LT(second.end_ns, third.start_ns);
  EXPECT_EQ(third.start_ns, third.end_ns) << "not ended";
}

// Handles a frame with two steps. Returns the count of each latency in the node's final status, and
// under "traces" the number of published traces.
std::map<std::string, std::uint64_t> handle_frame(bus::Bus& bus, bool with_reader) {
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  std::optional<bus::Reader<bus::topics::FrameTrace>> traces;
  if (with_reader) traces.emplace(bus.reader<bus::topics::FrameTrace>());
  FrameSteps steps;
  steps.begin("wait");
  wait_for_the_clock();
  steps.begin("work");
  {
    NodeStatusReporter status(bus, "node");
    FrameTracer tracer(bus, status, "node");
    EXPECT_TRUE(test::eventually(
        bus, 10s, [&] { return statuses.writers() == 1 && (!traces || traces->writers() == 1); }));
    tracer.handled(17, 1000, {2000, 3000}, steps);
  }
  steps.end();
  int received = 0;
  if (traces) {
    EXPECT_TRUE(test::eventually(bus, 10s, [&] {
      for (const auto& trace : traces->take()) {
        if (!trace.valid()) continue;
        ++received;
        EXPECT_STREQ(trace->node, "node");
        EXPECT_EQ(trace->frame, 17u);
        EXPECT_EQ(trace->capture_stamp_ns, 1000);
        EXPECT_EQ(trace->first_input_ns, 2000);
        EXPECT_EQ(trace->last_input_ns, 3000);
        const auto sent = messages::span_of(trace->steps);
        EXPECT_EQ(sent.size(), 2u);
        for (std::size_t i = 0; i < sent.size(); ++i) {
          EXPECT_EQ(sent[i].step, steps.steps()[i].name);
          EXPECT_EQ(sent[i].start_ns, steps.steps()[i].start_ns);
        }
        EXPECT_EQ(sent[0].end_ns, sent[1].start_ns);
        EXPECT_GT(sent[1].end_ns, sent[1].start_ns) << "handled() ends the last step";
      }
      return received > 0;
    }));
  }
  std::map<std::string, std::uint64_t> counts;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    for (const auto& sample : statuses.take()) {
      if (!sample.valid() || !sample->final_report) continue;
      EXPECT_EQ(sample->frame, 17u);
      for (const auto& latency : messages::span_of(sample->latencies)) {
        counts[latency.name] = latency.count;
        if (latency.name == std::string("wait")) {
          const FrameSteps::Step& wait = steps.steps()[0];
          EXPECT_FLOAT_EQ(latency.max_ms, 1e-6 * double(wait.end_ns - wait.start_ns));
        }
      }
    }
    return !counts.empty();
  }));
  counts["traces"] = bus.sent()[bus::topics::FrameTrace::name];
  return counts;
}

TEST(FrameTracer, ReportsTheStepsAsLatenciesAndPublishesThemForAReader) {
  using Counts = std::map<std::string, std::uint64_t>;
  bus::Bus bus({test::own_domain()});
  EXPECT_EQ(handle_frame(bus, false), (Counts{{"wait", 1}, {"work", 1}, {"traces", 0}}));
  EXPECT_EQ(handle_frame(bus, true), (Counts{{"wait", 1}, {"work", 1}, {"traces", 1}}));
}

}  // namespace
}  // namespace fivepipe::node
