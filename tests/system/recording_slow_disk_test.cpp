// `fivepipe record` on a disk that takes a tenth of what arrives.
#include <gtest/gtest.h>
#include <signal.h>

#include <random>
#include <thread>

#include "common/pipeline/messages/wire_conversions.h"
#include "common/recording/files/format.h"
#include "tests/support/recording/recordings.h"
#include "tests/support/sanitizer.h"
#include "tests/support/text.h"

namespace fivepipe::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using recording::Recording;

constexpr std::size_t kMessageBytes = 100'000;
constexpr auto kPeriod = 10ms;  // 10 MB/s
constexpr const char* kDisk_bytes_s = "1e6";

class RecordingOnSlowDisk : public RecordingTest {
 protected:
  const std::filesystem::path file_ = folder_ / "slow.mcap";
  bus::Writer<bus::topics::ObjectColour> colours_ = bus_.writer<bus::topics::ObjectColour>();
  std::uint64_t sent_ = 0;

  // Starts a recorder whose disk is slow.
  std::unique_ptr<Program> slow_recorder() {
    const char* asan = std::getenv("ASAN_OPTIONS");
    const std::string asan_before = asan ? asan : "";
    setenv("LD_PRELOAD", FIVEPIPE_SLOW_DISK, 1);
    setenv("FIVEPIPE_TEST_WRITE_SPEED", kDisk_bytes_s, 1);
    // The preloaded library precedes that of the sanitizer.
    setenv("ASAN_OPTIONS", (asan_before + ":verify_asan_link_order=0").c_str(), 1);
    auto program = recorder(file_, {"--compression", "none"});
    unsetenv("LD_PRELOAD");
    unsetenv("FIVEPIPE_TEST_WRITE_SPEED");
    setenv("ASAN_OPTIONS", asan_before.c_str(), 1);
    EXPECT_TRUE(eventually(bus_, 10s, [&] { return colours_.readers() == 1; }));
    return program;
  }
  // Sends messages until the condition holds.
  void send_until(const std::function<bool()>& condition) {
    std::vector<std::uint8_t> bytes(kMessageBytes);
    fivepipe_v1_ObjectColour message{};
    messages::set_text(message.camera, "left");
    messages::borrow(message.bgr, bytes);
    const auto end = Clock::now() + 30s;
    for (auto next = Clock::now(); !condition(); std::this_thread::sleep_until(next += kPeriod)) {
      ASSERT_LT(Clock::now(), end);
      message.frame = ++sent_;
      colours_.write(message);
    }
  }
  std::string info() {
    Program program({std::string(FIVEPIPE_BINARY_DIR) + "/fivepipe", "info", file_.string()},
                    folder_ / "info.log");
    EXPECT_TRUE(program.wait_for_end(20s));
    return program.said();
  }
};

// 2 s of data are 20 MB, which the disk takes in 20 s.
TEST_F(RecordingOnSlowDisk, SigtermEndsTheRecorderWithinTwoSecondsAndTheLossIsStated) {
  auto recorder = slow_recorder();
  send_until([&] { return sent_ == 200; });
  const auto signalled = Clock::now();
  recorder->signal(SIGTERM);
  EXPECT_EQ(recorder->wait_for_end(20s), 1) << recorder->said();
  EXPECT_LT(Clock::now() - signalled, 2s * kSlowdown) << recorder->said();
  EXPECT_TRUE(contains(recorder->said(), "messages lost: the disk was too slow"))
      << recorder->said();
  const Recording recording(file_);
  ASSERT_TRUE(recording.mcap().is_finished()) << recording.mcap().damage().summary;
  const auto counts = recording.metadata(recording::kCountsMetadata);
  const std::string topic = bus::topics::ObjectColour::name;
  const std::uint64_t received = std::stoull(counts.at(topic + " received")),
                      written = std::stoull(counts.at(topic + " written")),
                      lost = std::stoull(counts.at(topic + " lost"));
  EXPECT_EQ(received, sent_);
  EXPECT_EQ(written + lost, received);
  EXPECT_GT(lost, sent_ / 2);
  EXPECT_EQ(counts_by_topic(recording).at(topic), written);
  EXPECT_TRUE(contains(info(), "LOST")) << info();
  EXPECT_TRUE(contains(info(), "the disk was too slow")) << info();
}

TEST_F(RecordingOnSlowDisk, AKilledRecordersFileStatesWhatWaitedForTheDisk) {
  auto recorder = slow_recorder();
  send_until([&] {
    return sent_ % 20 == 0 && !Recording(file_).metadata(recording::kCountsSoFarMetadata).empty();
  });
  recorder->signal(SIGKILL);
  ASSERT_TRUE(recorder->wait_for_end(10s));
  const std::string said = info();
  EXPECT_TRUE(contains(said, "received messages are not in the file: they waited for the disk"))
      << said;
  EXPECT_TRUE(contains(said, "known until")) << said;
}

}  // namespace
}  // namespace fivepipe::test
