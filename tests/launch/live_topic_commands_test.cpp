#include "tests/launch/recording_commands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "common/pipeline/bus/bus.h"
#include "tests/support/test_domain.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;

// Writes frames on the bus while it exists.
class LiveWriter {
 public:
  explicit LiveWriter(std::uint32_t domain)
      : bus_({domain, "loopback", "render_x"}),
        writer_(bus_.writer<bus::topics::FrameComposited>()),
        thread_([this](std::stop_token stop) {
          fivepipe_v1_FrameComposited message{};
          std::snprintf(message.viewer, sizeof message.viewer, "viewer");
          for (; !stop.stop_requested(); ++message.frame, std::this_thread::sleep_for(10ms))
            writer_.write(message);
        }) {}

 private:
  bus::Bus bus_;
  bus::Writer<bus::topics::FrameComposited> writer_;
  std::jthread thread_;
};

TEST(RecordingCommandsLive, ShowTopicsWritersAndRates) {
  const std::uint32_t domain = test::own_domain();
  const LiveWriter writer(domain);
  const std::string in_domain = " --domain " + std::to_string(domain);
  const Answer ls = fivepipe("ls" + in_domain);
  EXPECT_EQ(ls.exit_code, 0) << ls.text;
  EXPECT_TRUE(holds(ls, kCompositedTopic + "  " + kCompositedType) && holds(ls, "reliable, last") &&
              holds(ls, "render_x"))
      << ls.text;
  EXPECT_EQ(fivepipe("ls --nodes" + in_domain).text,
            "node      writes           reads\nrender_x  FrameComposited  -\n");

  const Answer echo = fivepipe("echo FrameComposited --field viewer --count 3" + in_domain);
  EXPECT_EQ(echo.exit_code, 0) << echo.text;
  EXPECT_EQ(std::count(echo.text.begin(), echo.text.end(), '\n'), 3) << echo.text;
  EXPECT_TRUE(echo.text.starts_with("--- viewer  # ") && holds(echo, " render_x, latency "))
      << echo.text;
  const Answer head = shell("bash -c 'set -o pipefail; " + program + "echo FrameComposited" +
                            in_domain + " | head -n 2'");
  EXPECT_EQ(head.exit_code, 0) << head.text;

  const Answer hz = fivepipe("hz FrameComposited --once 1.5" + in_domain);
  EXPECT_EQ(hz.exit_code, 0) << hz.text;
  EXPECT_TRUE(holds(hz, "render_x") && holds(hz, "frames, none missing")) << hz.text;
}

TEST(RecordingCommandsLive, EchoReportsUnregisteredWriterAndExits) {
  const std::uint32_t domain = test::own_domain();
  auto writer = std::make_optional<LiveWriter>(domain);
  FILE* echo = popen(
      (program + "echo FrameComposited --json --domain " + std::to_string(domain)).c_str(), "r");
  ASSERT_TRUE(echo);
  char line[4096];
  ASSERT_TRUE(fgets(line, sizeof line, echo));
  writer.reset();
  while (std::string(line).find("key_change") == std::string::npos)
    ASSERT_TRUE(fgets(line, sizeof line, echo));
  const auto last = nlohmann::json::parse(line);
  EXPECT_EQ(last["key_change"], "unregistered");
  EXPECT_EQ(last["key"]["viewer"], "viewer");
  EXPECT_EQ(last["writer"], "render_x");
  EXPECT_EQ(pclose(echo), 0) << "echo did not exit when its reader closed the pipe";
}

TEST(RecordingCommandsLive, ReportEmptyDomain) {
  const std::string in_domain = " --domain " + std::to_string(test::own_domain());
  const Answer ls = fivepipe("ls" + in_domain);
  EXPECT_EQ(ls.exit_code, 3) << ls.text;
  EXPECT_TRUE(holds(ls, "no participant")) << ls.text;
  EXPECT_EQ(fivepipe("hz HeadPose --once 0.3" + in_domain).exit_code, 3);
  EXPECT_EQ(fivepipe("echo NoSuchTopic" + in_domain).exit_code, 2);
}

}  // namespace
}  // namespace fivepipe::launch
