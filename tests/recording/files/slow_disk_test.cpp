// A recording on a disk that takes less than arrives, or fails.
// tests/support/programs/slow_disk.cpp replaces the calls.
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <system_error>
#include <thread>

#include "common/recording/files/format.h"
#include "common/recording/mcap/recover.h"
#include "tests/support/recording/synthetic_recordings.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::recording {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

using test::kStart_ns;
constexpr double kDisk_bytes_s = 1e6;
// The disk takes one piece at a time, and calls are not interrupted.
constexpr auto kPieceTime =
    std::chrono::duration<double>(double(mcap::AppendFile::kPieceBytes) / kDisk_bytes_s);
constexpr auto kSlack = 500ms * test::kSlowdown;  // for a busy machine

std::size_t messages_in(const Recording& recording) {
  std::size_t count = 0;
  for (auto cursor = recording.messages(); cursor.next();) ++count;
  return count;
}

class SlowDisk : public testing::Test {
 protected:
  ~SlowDisk() override {
    unsetenv("FIVEPIPE_TEST_WRITE_SPEED");
    unsetenv("FIVEPIPE_TEST_SYNC_SPEED");
    unsetenv("FIVEPIPE_TEST_SYNC_ERROR");
    unsetenv("FIVEPIPE_TEST_EMPTY_WRITE");
  }
  static void slow_down(const char* variable) {
    setenv(variable, std::to_string(kDisk_bytes_s).c_str(), 1);
  }
  // Adds 20 MB, which the disk takes in 20 s.
  static constexpr std::uint64_t kMessages = 20'000;
  static void add_messages(RecordingWriter& writer) {
    const auto channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
    const std::vector<std::byte> payload(1000);
    for (std::uint64_t i = 0; i < kMessages; ++i)
      writer.add(channel, kStart_ns + std::int64_t(i) * 1'000'000, kStart_ns, payload);
  }
  static FinishLimits limits(Clock::time_point drop, Clock::time_point over) {
    return {[=] { return Clock::now() < drop ? "" : "the disk is slow"; },
            [=] { return Clock::now() >= over; }};
  }

  test::TestFolder folder_;
  const std::filesystem::path path_ = folder_.path / "slow.mcap";
};

constexpr WriterOptions kUncompressed{.compression = mcap::Compression::none};

TEST_F(SlowDisk, FinishDropsInTimeWhatTheDiskDoesNotTakeAndCountsIt) {
  RecordingWriter writer(path_, "tests", kUncompressed);
  slow_down("FIVEPIPE_TEST_WRITE_SPEED");
  add_messages(writer);
  const auto start = Clock::now();
  writer.finish(limits(start + 500ms, start + 5s));
  EXPECT_LT(Clock::now() - start, 500ms + kPieceTime + kSlack);
  const TopicCounts counts = writer.counts().at("t");
  EXPECT_EQ(counts.received, kMessages);
  EXPECT_EQ(counts.written + counts.lost, kMessages);
  EXPECT_GT(counts.lost, kMessages / 2);
  EXPECT_EQ(writer.loss_reason(), "the disk is slow");
  EXPECT_EQ(writer.failure(), "");
  EXPECT_TRUE(writer.is_finished());
  const Recording recording(path_);
  EXPECT_TRUE(recording.mcap().is_finished()) << recording.mcap().damage().summary;
  EXPECT_EQ(messages_in(recording), counts.written);
  const auto stored = recording.metadata(kCountsMetadata);
  EXPECT_EQ(stored.at("t lost"), std::to_string(counts.lost));
  EXPECT_EQ(stored.at(kLossReasonKey), "the disk is slow");
}

// The kernel takes everything and writes it to the disk later.
TEST_F(SlowDisk, FinishDoesNotWaitForTheDisksCache) {
  slow_down("FIVEPIPE_TEST_SYNC_SPEED");
  RecordingWriter writer(path_, "tests", kUncompressed);
  add_messages(writer);
  const auto start = Clock::now();
  writer.finish(limits(start + 500ms, start + 1s));
  EXPECT_LT(Clock::now() - start, 1s + kPieceTime + kSlack);
  EXPECT_TRUE(writer.is_finished());
  EXPECT_FALSE(writer.is_synced());
  EXPECT_EQ(messages_in(Recording(path_)), writer.counts().at("t").written);
}

// The file has the counts, although there was no time for the index.
TEST_F(SlowDisk, AFileWithoutIndexHasTheCounts) {
  RecordingWriter writer(path_, "tests", kUncompressed);
  slow_down("FIVEPIPE_TEST_WRITE_SPEED");
  add_messages(writer);
  writer.finish(limits(Clock::now(), Clock::now()));
  EXPECT_FALSE(writer.is_finished());
  EXPECT_EQ(writer.failure(), "");
  const TopicCounts counts = writer.counts().at("t");
  EXPECT_EQ(Recording(path_).metadata(kCountsMetadata).at("t lost"), std::to_string(counts.lost));
  // The writer still holds its file.
  const std::filesystem::path copy = folder_.path / "copy.mcap";
  std::filesystem::copy_file(path_, copy);
  EXPECT_FALSE(mcap::recover(copy).was_finished);
  EXPECT_EQ(messages_in(Recording(copy)), counts.written);
}

// Killing the recorder leaves the file as it is at that time.
TEST_F(SlowDisk, AFileThatIsCutOffHasTheNewestCounts) {
  RecordingWriter writer(
      path_, "tests",
      {.compression = mcap::Compression::none, .chunk_bytes = 200'000, .counts_s = 0});
  slow_down("FIVEPIPE_TEST_WRITE_SPEED");
  add_messages(writer);
  const auto before = Clock::now();
  // The counts after the next chunk are of all messages.
  const std::uint64_t enough = std::max<std::uint64_t>(500'000, writer.bytes_written() + 450'000);
  while (writer.bytes_written() < enough) ASSERT_LT(Clock::now() - before, 30s);
  const std::filesystem::path cut = folder_.path / "cut.mcap";
  std::filesystem::copy_file(path_, cut);
  const Recording recording(cut);
  EXPECT_FALSE(recording.mcap().is_finished());
  const auto counts = recording.metadata(kCountsSoFarMetadata);
  EXPECT_EQ(counts.at("t received"), std::to_string(kMessages));
  EXPECT_EQ(counts.at("t lost"), "0");
  EXPECT_NE(counts.at("t written"), "0") << "the first record, not the newest";
  EXPECT_GT(std::stoll(counts.at(kCountsStampKey)), kStart_ns);
  EXPECT_LT(messages_in(recording), kMessages / 2);
  writer.finish(limits(Clock::now(), Clock::now() + 1s));
}

// The call that reports a failed write resets the error, so a later fdatasync() returns 0.
TEST_F(SlowDisk, AFailedWriteOfTheDisksCacheIsReported) {
  setenv("FIVEPIPE_TEST_SYNC_ERROR", "1", 1);
  RecordingWriter writer(path_, "tests", kUncompressed);
  add_messages(writer);
  writer.finish();
  EXPECT_NE(writer.failure().find("cannot be synchronised with the disk"), std::string::npos)
      << writer.failure();
  EXPECT_FALSE(writer.is_synced());
}

// A power cut costs at most the open chunk.
TEST_F(SlowDisk, EachChunkIsSynchronisedWhenItIsWritten) {
  setenv("FIVEPIPE_TEST_SYNC_ERROR", "2", 1);
  RecordingWriter writer(path_, "tests", kUncompressed);
  const auto channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  writer.add(channel, kStart_ns, kStart_ns, std::vector<std::byte>(1000));
  writer.tick(kStart_ns + 1'000'000'000);
  const auto start = Clock::now();
  while (writer.failure().empty() && Clock::now() - start < 20s) std::this_thread::yield();
  EXPECT_NE(writer.failure().find("cannot be synchronised with the disk"), std::string::npos);
}

TEST_F(SlowDisk, NothingIsSynchronisedIfNotRequested) {
  setenv("FIVEPIPE_TEST_SYNC_ERROR", "3", 1);
  RecordingWriter writer(path_, "tests", {.sync = false});
  const auto channel = writer.add_channel("t", test::kFramedType, test::kFramedIdl, {});
  writer.add(channel, kStart_ns, kStart_ns, std::vector<std::byte>(1000));
  writer.finish(limits(Clock::now() + 1h, Clock::now() + 1h));
  EXPECT_EQ(writer.failure(), "");
  EXPECT_TRUE(writer.is_finished());
  EXPECT_FALSE(writer.is_synced());
}

TEST_F(SlowDisk, AWriteOfNothingIsAFullDisk) {
  mcap::AppendFile file = mcap::AppendFile::create(path_);
  setenv("FIVEPIPE_TEST_EMPTY_WRITE", "1", 1);
  const std::vector<std::byte> bytes(1000);
  try {
    file.append(bytes);
    ADD_FAILURE() << "no error";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), ENOSPC) << error.what();
  }
  EXPECT_TRUE(file.append(bytes));
}

TEST_F(SlowDisk, CountsSoFarAreRecordedPeriodically) {
  RecordingWriter writer(path_, "tests", {.chunk_bytes = 20'000, .counts_s = 3600});
  add_messages(writer);
  writer.finish();
  EXPECT_TRUE(Recording(path_).metadata(kCountsSoFarMetadata).empty());
}

}  // namespace
}  // namespace fivepipe::recording
