#include "common/pipeline/node/status.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <fstream>
#include <map>
#include <thread>

#include "common/base/realtime.h"
#include "common/base/version.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/node/drop_counts.h"
#include "common/pipeline/node/log_budget.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/captured_log.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::node {
namespace {

using namespace std::chrono_literals;

struct Reported {
  std::map<std::string, std::uint64_t> counts;
  std::map<messages::BadMessage, std::uint64_t> drops;
  std::map<std::string, fivepipe_v1_LatencySummary> latencies;
  std::map<std::string, std::uint64_t> sent;  // by topic
  std::map<std::string, std::string> diagnostics;
  std::string version, gl_renderer;
  std::int64_t start_stamp_ns = 0;
  bool has_handled_frame = false;
  std::uint64_t frame = 0;
  double frame_rate_hz = 0, cpu_s = 0, memory_mb = 0;
};

Reported reported_by(const fivepipe_v1_NodeStatus& status) {
  Reported got;
  for (const auto& count : messages::span_of(status.counts)) got.counts[count.name] = count.count;
  for (const auto& drop : messages::span_of(status.drops))
    got.drops[{drop.reason, drop.subject, drop.detail}] = drop.count;
  for (const auto& latency : messages::span_of(status.latencies))
    got.latencies[latency.name] = latency;
  for (const auto& topic : messages::span_of(status.topics)) got.sent[topic.topic] = topic.sent;
  for (const auto& diagnostic : messages::span_of(status.diagnostics))
    got.diagnostics[diagnostic.subject] = diagnostic.text;
  got.version = status.version;
  got.gl_renderer = status.gl_renderer;
  got.start_stamp_ns = status.start_stamp_ns;
  got.has_handled_frame = status.has_handled_frame;
  got.frame = status.frame;
  got.frame_rate_hz = status.frame_rate_hz;
  got.cpu_s = status.cpu_s;
  got.memory_mb = status.memory_mb;
  return got;
}

// Returns the final report of a node.
template <class Use>
Reported reported(bus::Bus& bus, Use use) {
  auto reader = bus.reader<bus::topics::NodeStatus>();
  {
    NodeStatusReporter status(bus, "node");
    EXPECT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 1; }));
    use(status);
  }
  Reported last;
  bool ended = false;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    for (const auto& sample : reader.take()) {
      if (!sample.valid()) continue;
      last = reported_by(*sample);
      ended = sample->final_report;
    }
    return ended;
  }));
  return last;
}

double cpu_time_s() { return double(std::clock()) / CLOCKS_PER_SEC; }

double resident_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (double kib = 0; word == "VmRSS:" && status >> kib) return 1.024e-3 * kib;
  return 0;
}

TEST(NodeStatus, ReportsTheProcess) {
  bus::Bus bus({test::own_domain()});
  const std::int64_t before_ns = base::now_realtime_ns();
  const double cpu_before_s = cpu_time_s(), before_mb = resident_mb();
  Reported last = reported(bus, [](NodeStatusReporter& status) {
    status.set_gl_renderer(std::string(200, 'x'));
    status.count(std::string(63, 'y') + "zzz");
  });
  const double after_mb = resident_mb();
  EXPECT_EQ(last.version, base::version());
  EXPECT_EQ(last.gl_renderer, std::string(128, 'x')) << "truncates a text that is too long";
  EXPECT_EQ(last.counts.begin()->first, std::string(63, 'y') + "z");
  EXPECT_GE(last.start_stamp_ns, before_ns);
  EXPECT_LE(last.start_stamp_ns, base::now_realtime_ns());
  EXPECT_GE(last.cpu_s, cpu_before_s - 0.02);
  EXPECT_LE(last.cpu_s, cpu_time_s() + 0.02);
  EXPECT_GE(last.memory_mb, 0.7 * before_mb);
  EXPECT_LE(last.memory_mb, 1.4 * after_mb);
  EXPECT_FALSE(last.has_handled_frame);
  EXPECT_EQ(last.frame_rate_hz, 0);
}

TEST(NodeStatus, ALatencySinceTheCaptureIsByTheClockOfTheCapture) {
  bus::Bus bus({test::own_domain()});
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  auto hosts = bus.writer<bus::topics::HostStatus>();
  CaptureClock clock(bus, "beta", "alpha");
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return hosts.readers() == 1; }));
  const auto send = [&](const char* host, const char* program, const char* other,
                        std::int64_t offset_ns, std::int64_t error_ns) {
    std::vector<fivepipe_v1_ClockAnswer> clocks(1);
    messages::set_text(clocks[0].host, other);
    messages::set_text(clocks[0].program, "up");
    clocks[0].offset_ns = offset_ns;
    clocks[0].error_ns = error_ns;
    fivepipe_v1_HostStatus message{};
    messages::set_text(message.host, host);
    messages::set_text(message.program, program);
    messages::borrow(message.clocks, clocks);
    hosts.write(message);
    EXPECT_TRUE(hosts.wait_for_delivery(10s));
  };
  NodeStatusReporter status(bus, "rendering", &clock);
  constexpr std::int64_t kNow_ns = 100'000'000'000, kMs = 1'000'000;
  // Not of this host's `up`, of another host, or not compared yet.
  send("gamma", "up", "alpha", 7 * kMs, 0);
  send("beta", "doctor", "alpha", 7 * kMs, 0);
  send("beta", "up", "gamma", 7 * kMs, 0);
  send("beta", "up", "alpha", 7 * kMs, -1);
  send("beta", "up", "alpha", INT64_MAX, 0);
  send("beta", "up", "alpha", INT64_MIN, 0);
  // The node takes messages before each of its statuses.
  statuses.take();
  int n = 0;
  ASSERT_TRUE(test::eventually(bus, 10s, [&] {
    n += int(statuses.take().size());
    return n >= 2;
  }));
  status.latency_since_capture("since", kNow_ns - 30 * kMs, kNow_ns);
  EXPECT_EQ(clock.offset_ns(), std::nullopt);
  // The clock of alpha is ahead, so that its stamps are, too.
  send("beta", "up", "alpha", 2000 * kMs, kMs);
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return clock.offset_ns().has_value(); }));
  status.latency_since_capture("since", kNow_ns + 1970 * kMs, kNow_ns);
  std::map<std::string, double> max_ms;
  EXPECT_TRUE(test::eventually(bus, 10s, [&] {
    for (const auto& sample : statuses.take())
      for (const auto& latency : messages::span_of(sample->latencies))
        max_ms[latency.name] = latency.max_ms;
    return max_ms.size() == 2;
  }));
  EXPECT_NEAR(max_ms["since"], 30, 1e-3);
  EXPECT_NEAR(max_ms[std::string("since") + kNotCompared], 30, 1e-3);
}

// A node that waits for another host has no latency to correct.
TEST(NodeStatus, WarnsOfClocksThatAreNotComparedOnceALatencyNeedsThem) {
  bus::Bus bus({test::own_domain()});
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  CaptureClock clock(bus, "beta", "alpha");
  NodeStatusReporter status(bus, "rendering", &clock);
  std::string warning;
  const auto newest_warning = [&] {
    for (const auto& sample : statuses.take())
      for (const auto& diagnostic : messages::span_of(sample->diagnostics))
        warning = diagnostic.text;
    return warning;
  };
  EXPECT_FALSE(test::eventually(bus, NodeStatusReporter::kComparisonPatience + 1s, [&] {
    return !newest_warning().empty();
  })) << warning;
  status.latency_since_capture("since", 0, 1);
  EXPECT_TRUE(test::eventually(bus, 2 * NodeStatusReporter::kComparisonPatience, [&] {
    return newest_warning().starts_with(
        "no clock comparison with host alpha, which captures, for more than 5 s; is `fivepipe up` "
        "running on both hosts?");
  })) << warning;
}

TEST(NodeStatus, CountsTheCpuTimeOfTheFramesAfterTheFirst) {
  const auto work = [] {
    for (const double until_s = cpu_time_s() + 0.2; cpu_time_s() < until_s;) {
    }
  };
  bus::Bus bus({test::own_domain()});
  double since_first_s = 0;
  Reported last = reported(bus, [&](NodeStatusReporter& status) {
    work();
    status.frame_handled(0);
    const double at_first_s = cpu_time_s();
    work();
    status.frame_handled(1);
    since_first_s = cpu_time_s() - at_first_s;
  });
  const double counted_s = 1e-6 * double(last.counts.at(kFramesCpu));
  EXPECT_GE(counted_s, since_first_s - 0.02);
  EXPECT_LE(counted_s, since_first_s + 0.1);  // the final report takes some
  last = reported(bus, [](NodeStatusReporter&) {});
  EXPECT_FALSE(last.counts.contains(kFramesCpu)) << "no frame";
}

// Nearest rank above: the value at floor(q n) of the sorted ones.
TEST(NodeStatus, ReportsQuantilesOfTheNewestLatencies) {
  constexpr int kWindow = 1 << 13;
  bus::Bus bus({test::own_domain()});
  Reported last = reported(bus, [](NodeStatusReporter& status) {
    for (int i = 0; i < 200; ++i) status.latency("shuffled", 1e-3 * (1 + 77 * i % 200));
    status.latency("one", 0.25);
    status.latency("full", 2);
    status.latency("over", 2);
    for (int i = 1; i < kWindow; ++i) status.latency("full", 1);
    for (int i = 1; i < kWindow; ++i) status.latency("over", 1);
    status.latency("over", 0.5);
  });
  const auto expect = [&](const std::string& name, std::array<double, 4> ms, std::uint64_t count) {
    const fivepipe_v1_LatencySummary& got = last.latencies[name];
    EXPECT_FLOAT_EQ(got.p50_ms, ms[0]) << name;
    EXPECT_FLOAT_EQ(got.p95_ms, ms[1]) << name;
    EXPECT_FLOAT_EQ(got.p99_ms, ms[2]) << name;
    EXPECT_FLOAT_EQ(got.max_ms, ms[3]) << name;
    EXPECT_EQ(got.count, count) << name;
  };
  expect("shuffled", {101, 191, 199, 200}, 200);
  expect("one", {250, 250, 250, 250}, 1);
  expect("full", {1000, 1000, 1000, 2000}, kWindow);
  expect("over", {1000, 1000, 1000, 1000}, kWindow + 1);
}

// Repeats a run in which the machine pauses this process for most of the second.
TEST(NodeStatus, ReportsTheFramesOfTheLastSecond) {
  bus::Bus bus({test::own_domain()});
  const auto rate_hz = [&](int frames) {
    while (true) {
      std::chrono::steady_clock::time_point start;
      const Reported last = reported(bus, [&](NodeStatusReporter& status) {
        start = std::chrono::steady_clock::now();
        for (int frame = 0; frame < frames; ++frame) status.frame_handled(100 + frame);
      });
      EXPECT_TRUE(last.has_handled_frame);
      EXPECT_EQ(last.frame, 99u + std::uint64_t(frames));
      if (std::chrono::steady_clock::now() - start < 900ms) return last.frame_rate_hz;
    }
  };
  EXPECT_EQ(rate_hz(1), 1);
  EXPECT_EQ(rate_hz(31), 31);
  EXPECT_EQ(rate_hz(5000), 4096) << "bounds the memory";
}

TEST(NodeStatus, ANewDiagnosticDoesNotWaitForThePeriod) {
  using Clock = std::chrono::steady_clock;
  bus::Bus bus({test::own_domain()});
  auto reader = bus.reader<bus::topics::NodeStatus>();
  NodeStatusReporter status(bus, "node");
  int statuses = 0;
  const auto diagnostics_arrive = [&](std::size_t count) {
    return test::eventually(bus, 10s, [&] {
      std::size_t newest = 0;
      for (const auto& sample : reader.take()) {
        if (!sample.valid()) continue;
        ++statuses;
        newest = sample->diagnostics._length;
      }
      return newest == count;
    });
  };
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return !reader.take().empty(); }));
  Clock::duration shortest = 1h;  // the machine may pause this process
  for (std::size_t round = 1; round <= 5; ++round) {
    const auto start = Clock::now();
    status.diagnostic("subject " + std::to_string(round), "text");
    ASSERT_TRUE(diagnostics_arrive(round));
    shortest = std::min(shortest, Clock::now() - start);
  }
  EXPECT_LT(shortest, 200ms);
  // Diagnostics that come and go do not flood the readers.
  statuses = 0;
  const auto start = Clock::now();
  while (Clock::now() - start < 1s) {
    status.diagnostic("subject 1", "");
    status.diagnostic("subject 1", "text");
    std::this_thread::sleep_for(5ms);
  }
  status.diagnostic("subject 6", "text");
  ASSERT_TRUE(diagnostics_arrive(6));
  EXPECT_LE(statuses, (Clock::now() - start) / 100ms + 2);
}

TEST(NodeStatus, ReportsTheNumberOfSentMessagesByTopic) {
  bus::Bus bus({test::own_domain()});
  const Reported last = reported(bus, [&](NodeStatusReporter&) {
    auto writer = bus.writer<bus::topics::FrameTrace>();
    for (int i = 0; i < 3; ++i) writer.write(fivepipe_v1_FrameTrace{});
  });
  EXPECT_EQ(last.sent.at(bus::topics::FrameTrace::name), 3u);
}

TEST(NodeStatus, NamesTheSendersOfRefusedMessages) {
  bus::Bus bus({test::own_domain()});
  const bus::ProcessId alpha{"alpha", 12, 1}, beta{"beta", 12, 2};
  const Reported last = reported(bus, [&](NodeStatusReporter& status) {
    for (int i = 0; i < 3; ++i) status.drop_from(alpha, {"bad_map", "left", "wrong image size"});
    status.drop_from(beta, {"bad_map", "left", "wrong image size"});
    status.refuse(std::nullopt, 7);
    status.drop("late_map", 5);
  });
  const std::string prefix = kRefusedFrom;
  EXPECT_EQ(last.counts,
            (std::map<std::string, std::uint64_t>{{prefix + "process 12 on host alpha", 3},
                                                  {prefix + "process 12 on host beta", 1},
                                                  {prefix + "a process without identity", 7}}));
  EXPECT_EQ(last.drops,
            (std::map<messages::BadMessage, std::uint64_t>{
                {{"bad_map", "left", "wrong image size"}, 4}, {{"late_map", "", ""}, 5}}));
}

// The reader of the node's bus refuses the keys beyond its limit.
TEST(NodeStatus, NamesTheSenderOfTooManyKeys) {
  bus::Bus bus({test::own_domain()});
  auto writer = bus.writer<bus::topics::FrameTrace>();
  auto reader = bus.reader<bus::topics::FrameTrace>();
  ASSERT_TRUE(test::eventually(bus, 10s, [&] { return reader.writers() == 1; }));
  constexpr std::uint64_t kKeys = bus::topics::kMaxKeys + 9;
  const test::CapturedLog log;
  const Reported last = reported(bus, [&](NodeStatusReporter&) {
    for (std::uint64_t key = 0; key < kKeys; ++key) {
      fivepipe_v1_FrameTrace trace{};
      messages::set_text(trace.node, "node_" + std::to_string(key));
      writer.write(trace);
      reader.take();
    }
  });
  const std::string topic = bus::topics::FrameTrace::name;
  EXPECT_EQ(last.drops.at({"too_many_keys", topic, ""}), 9u);
  EXPECT_EQ(last.counts.at(kRefusedFrom + bus::text_of(bus::this_process())), 9u);
  EXPECT_NE(log.text().find("dropped: " + messages::text_of({"too_many_keys", topic, ""})),
            std::string::npos)
      << log.text();
}

// Returns what a node logs until its end.
template <class Use>
std::string logged(Use use) {
  bus::Bus bus({test::own_domain()});
  const test::CapturedLog log;
  reported(bus, use);
  return log.text();
}

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

TEST(NodeStatus, LogsADropOnceAndANewDiagnosticEachTime) {
  const std::string log = logged([](NodeStatusReporter& status) {
    for (int i = 0; i < 3; ++i) status.drop("late_map", 2);
    status.drop("late_pose", 0);
    for (const char* text : {"dark", "dark", "bright", "", "bright"})
      status.diagnostic("camera left", text);
  });
  EXPECT_EQ(occurrences(log, "dropped: "), 1u) << log;
  EXPECT_EQ(occurrences(log, "dropped: late_map (2 so far)"), 1u) << log;
  EXPECT_EQ(occurrences(log, "camera left: dark"), 1u) << log;
  EXPECT_EQ(occurrences(log, "camera left: bright"), 2u) << log;
  EXPECT_EQ(occurrences(log, "camera left: "), 3u) << "none for the empty text\n" << log;
}

TEST(NodeStatus, LogsTheRenderer) {
  const std::string log =
      logged([](NodeStatusReporter& status) { status.set_gl_renderer("llvmpipe"); });
  EXPECT_EQ(occurrences(log, "OpenGL: llvmpipe"), 1u) << log;
}

TEST(StageTimer, ReportsItsLifetimeAsALatency) {
  using Clock = std::chrono::steady_clock;
  bus::Bus bus({test::own_domain()});
  std::chrono::duration<float, std::milli> min_ms{}, max_ms{};
  Reported last = reported(bus, [&](NodeStatusReporter& status) {
    const auto before = Clock::now();
    {
      const StageTimer timer(status, "stage");
      const auto start = Clock::now();
      while (Clock::now() - start < 2ms) {
      }
      min_ms = Clock::now() - start;
    }
    max_ms = Clock::now() - before;
  });
  EXPECT_EQ(last.latencies["stage"].count, 1u);
  EXPECT_GE(last.latencies["stage"].max_ms, min_ms.count());
  EXPECT_LE(last.latencies["stage"].max_ms, max_ms.count());
}

TEST(NodeStatus, LogsHowManyLinesItSuppresses) {
  bus::Bus bus({test::own_domain()});
  auto statuses = bus.reader<bus::topics::NodeStatus>();
  const test::CapturedLog log;
  {
    NodeStatusReporter status(bus, "node");
    for (int i = 0; i < LogBudget::kMaxLines + 7; ++i)
      status.diagnostic("camera left", "text " + std::to_string(i));
    int received = 0;
    EXPECT_TRUE(test::eventually(bus, 20s, [&] {
      for (const auto& sample : statuses.take()) {
        EXPECT_FALSE(sample.valid() && sample->final_report);
        received += sample.valid();
      }
      return received >= 3;  // the node logs the line after the second one at the latest
    }));
  }
  EXPECT_EQ(occurrences(log.text(), "7 more lines are not logged"), 1u) << log.text();
}

TEST(NodeStatus, APeersTextCannotControlTheTerminal) {
  const std::string log = logged([](NodeStatusReporter& status) {
    status.drop({"bad_camera_info", "\x1b[2J", "unknown camera \x1b[2J"});
    status.diagnostic("camera left", "process 12 on host \x1b[2J: another model");
  });
  EXPECT_NE(log.find("bad_camera_info: ?[2J"), std::string::npos) << log;
  EXPECT_NE(log.find("camera left: process 12 on host ?[2J"), std::string::npos) << log;
  EXPECT_EQ(log.find('\x1b'), std::string::npos);
}

TEST(NodeStatus, MessagesDoNotSuppressTheLinesAboutTheStart) {
  const std::string log = logged([](NodeStatusReporter& status) {
    for (int i = 0; i < 30; ++i) status.diagnostic("camera left", "text " + std::to_string(i));
    status.start_progress("precomputing frames, 10 %");
    status.start_progress("precomputing frames, 10 %");
    status.start_progress("");
  });
  EXPECT_EQ(log.find("text 29"), std::string::npos) << log;
  const std::size_t first = log.find("start: precomputing frames, 10 %");
  ASSERT_NE(first, std::string::npos) << log;
  EXPECT_EQ(log.find("start: ", first + 1), std::string::npos) << "the text is the same\n" << log;
}

TEST(NodeStatus, IsBoundedForInventedNamesAndSenders) {
  bus::Bus bus({test::own_domain()});
  constexpr std::uint32_t kMessages = 5000;
  const Reported last = reported(bus, [&](NodeStatusReporter& status) {
    for (std::uint32_t i = 0; i < kMessages; ++i)
      status.drop_from(bus::ProcessId{"alpha", i, i},
                       {"bad_map", "invented_" + std::to_string(i), "unknown camera"});
  });
  EXPECT_EQ(last.drops.size(), 25u) << "24 names, and the others";
  EXPECT_EQ(last.counts.size(), 17u) << "16 names, and the others";
  std::uint64_t drops = 0, refused = 0;
  for (const auto& [bad, count] : last.drops) drops += count;
  for (const auto& [name, count] : last.counts) refused += count;
  EXPECT_EQ(drops, kMessages);
  EXPECT_EQ(refused, kMessages);
}

}  // namespace
}  // namespace fivepipe::node
