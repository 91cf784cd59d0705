#include "common/recording/mcap/append_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <random>
#include <system_error>
#include <thread>

#include "tests/support/process/open_files.h"
#include "tests/support/recording/mcap_files.h"

namespace fivepipe::mcap {
namespace {

TEST(AppendFile, AFileThatWasMovedFromClosesNoFile) {
  const test::TestFolder folder;
  {
    AppendFile first = AppendFile::create(folder.path / "file");
    const AppendFile second = std::move(first);
  }
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    EXPECT_NE(fcntl(standard, F_GETFD), -1) << standard;
  EXPECT_NO_THROW(AppendFile::create(folder.path / "file")) << "the file is still locked";
}

Bytes bytes_of(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  Bytes bytes(count);
  for (std::byte& byte : bytes) byte = std::byte(random());
  return bytes;
}

// More than one piece of a write and than one block of a read.
TEST(AppendFile, KeepsWhatWasAppendedWithItsCrc) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "file";
  const Bytes all = bytes_of((5 << 19) + 7, 1);
  const ByteView view(all);
  {
    AppendFile first = AppendFile::create(path);
    EXPECT_EQ(first.size_bytes(), 0u);
    EXPECT_TRUE(first.append(view.first(100)));
    AppendFile file = std::move(first);
    EXPECT_TRUE(file.append(view.subspan(100)));
    EXPECT_EQ(file.size_bytes(), all.size());
    EXPECT_EQ(file.crc(), crc32_of(all));
    EXPECT_EQ(file.crc_of_whole_file(), crc32_of(all));
  }
  EXPECT_EQ(test::file_bytes(path), all);
  AppendFile again = AppendFile::reopen(path, 1000);
  EXPECT_EQ(again.size_bytes(), 1000u);
  EXPECT_EQ(again.crc_of_whole_file(), crc32_of(view.first(1000)));
  EXPECT_TRUE(again.append(view.subspan(1000, 10)));
  again.overwrite(3, std::byte(77));
  Bytes expected(all.begin(), all.begin() + 1010);
  expected[3] = std::byte(77);
  EXPECT_EQ(test::file_bytes(path), expected);
  EXPECT_EQ(again.crc(), crc32_of(view.subspan(1000, 10)));
}

TEST(AppendFile, AStoppedAppendLeavesTheFileAsItWas) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "file";
  AppendFile file = AppendFile::create(path);
  const Bytes start = bytes_of(10, 1), many = bytes_of(3 * AppendFile::kPieceBytes, 2);
  file.append(start);
  for (const int allowed : {0, 1, 2}) {
    int calls = 0;
    EXPECT_FALSE(file.append(many, [&] { return calls++ == allowed; }));
    EXPECT_EQ(calls, allowed + 1) << "once per piece";
    EXPECT_EQ(file.size_bytes(), start.size());
    EXPECT_EQ(file.crc(), crc32_of(start));
    EXPECT_EQ(test::file_bytes(path), start);
  }
  int calls = 0;
  EXPECT_TRUE(file.append(many, [&] { return calls++ == 3; }));
  EXPECT_EQ(calls, 3);
}

TEST(AppendFile, SyncWaitsForNewBytesOnly) {
  const test::TestFolder folder;
  AppendFile file = AppendFile::create(folder.path / "file");
  file.append(bytes_of(2 * AppendFile::kPieceBytes + 1, 1));
  const auto calls_of_sync = [&] {
    int calls = 0;
    EXPECT_TRUE(file.sync([&] { return ++calls > 100; }));
    return calls;
  };
  const int calls = calls_of_sync();
  EXPECT_TRUE(calls == 4 || calls == 2) << calls << ": once per piece, if the file system can";
  EXPECT_EQ(calls_of_sync(), 1);
  EXPECT_TRUE(file.sync());
  for (const int allowed : {0, 1}) {
    file.append(bytes_of(10, 1));
    int polls = 0;
    EXPECT_FALSE(file.sync([&] { return polls++ == allowed; }));
  }
}

TEST(AppendFile, ErrorsNameTheFile) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "file";
  const auto error_of = [](const auto& call) {
    try {
      call();
    } catch (const std::system_error& error) {
      return std::pair(error.code().value(), std::string(error.what()));
    }
    return std::pair(0, std::string());
  };
  const auto missing = error_of([&] { AppendFile::reopen(path, 0); });
  EXPECT_EQ(missing.first, ENOENT);
  EXPECT_EQ(missing.second.find(path.string() + ": cannot be opened for writing"), 0u);
  const AppendFile first = AppendFile::create(path);
  const std::size_t before = test::open_files();
  const auto locked = error_of([&] { AppendFile::create(path); });
  EXPECT_EQ(locked.first, EBUSY);
  EXPECT_EQ(locked.second.find(path.string() + ": another process writes to it"), 0u);
  EXPECT_EQ(test::open_files(), before) << "the file is still open";
}

TEST(AppendFile, CreateRemovesTheContentAndReopenTheEndOfAFile) {
  const test::TestFolder folder;
  const std::filesystem::path path = folder.path / "file";
  const Bytes before = bytes_of(100, 1);
  test::write_file(path, before);
  AppendFile::reopen(path, 99);
  EXPECT_EQ(test::file_bytes(path), Bytes(before.begin(), before.end() - 1));
  errno = EWOULDBLOCK;  // of an earlier call
  AppendFile::create(path);
  EXPECT_EQ(std::filesystem::file_size(path), 0u);
}

// Opens the device as soon as no other run of this test has locked it: all processes share the
// lock.
AppendFile open_device(const std::filesystem::path& path) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (true) try {
      return AppendFile::create(path);
    } catch (const std::system_error& error) {
      if (error.code().value() != EBUSY || std::chrono::steady_clock::now() > deadline) throw;
    }
}

// A device takes bytes but cannot be truncated or synchronised.
TEST(AppendFile, ADeviceNeedsNoSynchronisation) {
  AppendFile device = open_device("/dev/zero");
  EXPECT_TRUE(device.append(bytes_of(10, 1)));
  EXPECT_TRUE(device.sync([] { return false; }));
  EXPECT_TRUE(device.append(bytes_of(10, 1)));
  EXPECT_TRUE(device.sync());
  EXPECT_EQ(device.size_bytes(), 20u);
}

}  // namespace
}  // namespace fivepipe::mcap
