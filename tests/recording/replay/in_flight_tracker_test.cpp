#include "common/recording/replay/in_flight_tracker.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

#include "common/pipeline/messages/wire_conversions.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::replay {
namespace {

using namespace std::chrono_literals;

// Benchmarks subtract the stamps of a trace.
TEST(InFlightTracker, RefusesAndLogsTracesWithImpossibleStamps) {
  std::ostringstream log;
  const auto logger = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  bus::Bus bus({test::own_domain()});
  auto writer = bus.writer<bus::topics::FrameTrace>();
  const recording::Recording recording(FIVEPIPE_SOURCE_DIR "/tests/recordings/v1.mcap");
  ReplayPlan plan;
  plan.lossless = true;
  plan.nodes = {{"simulation", "sim_node"}};
  InFlightTracker tracker(bus, recording, plan, {});
  tracker.reset();
  std::vector<std::uint64_t> frames;
  tracker.on_trace = [&](const fivepipe_v1_FrameTrace& trace) { frames.push_back(trace.frame); };
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return writer.readers() == 1; }));
  const auto send = [&](std::uint64_t frame, std::int64_t first_input_ns) {
    fivepipe_v1_FrameTrace trace{};
    messages::set_text(trace.node, "simulation");
    trace.frame = frame;
    trace.first_input_ns = trace.last_input_ns = first_input_ns;
    writer.write(trace);
  };
  send(1, INT64_MIN);
  send(2, 1);
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    tracker.take_traces();
    return !frames.empty();
  }));
  spdlog::set_default_logger(logger);
  EXPECT_EQ(frames, std::vector<std::uint64_t>{2});
  EXPECT_NE(log.str().find("dropped: bad_trace: simulation: "), std::string::npos) << log.str();
  EXPECT_NE(log.str().find("(1 so far)"), std::string::npos) << log.str();
}

}  // namespace
}  // namespace fivepipe::replay
