#include "common/pipeline/node/status.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <map>
#include <sstream>

#include "common/pipeline/messages/wire_conversions.h"
#include "common/pipeline/node/drop_counts.h"
#include "common/pipeline/node/status_names.h"
#include "tests/support/process.h"
#include "tests/support/test_domain.h"

namespace fivepipe::node {
namespace {

using namespace std::chrono_literals;

struct Reported {
  std::map<std::string, std::uint64_t> counts;
  std::map<messages::BadMessage, std::uint64_t> drops;
};

// Receives what the process logs, instead of the default logger.
class CapturedLog {
 public:
  CapturedLog() {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>(
        "captured", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_)));
  }
  ~CapturedLog() { spdlog::set_default_logger(before_); }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;
  // Call it when no thread logs.
  std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
};

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
      last = {};
      for (const auto& count : messages::span_of(sample->counts))
        last.counts[count.name] = count.count;
      for (const auto& drop : messages::span_of(sample->drops))
        last.drops[{drop.reason, drop.subject, drop.detail}] = drop.count;
      ended = sample->final_report;
    }
    return ended;
  }));
  return last;
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
  const CapturedLog log;
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
  std::ostringstream log;
  const auto logger = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  reported(bus, use);
  spdlog::set_default_logger(logger);
  return log.str();
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
  EXPECT_EQ(last.drops.size(), DropCounts::kMaxPerReason + 1);
  EXPECT_LE(last.counts.size(), 17u);
  std::uint64_t drops = 0, refused = 0;
  for (const auto& [bad, count] : last.drops) drops += count;
  for (const auto& [name, count] : last.counts) refused += count;
  EXPECT_EQ(drops, kMessages);
  EXPECT_EQ(refused, kMessages);
}

}  // namespace
}  // namespace fivepipe::node
