#include "common/base/output_queue.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <set>
#include <system_error>

#include "tests/support/process/file_size_limit.h"
#include "tests/support/source_text.h"
#include "tests/support/test_folder.h"

namespace fivepipe::base {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Both ends of a pipe.
struct Pipe {
  int ends[2];
  Pipe() {
    EXPECT_EQ(pipe(ends), 0);
    // The size depends on the machine's page size. The long texts below must not fit.
    EXPECT_EQ(fcntl(ends[1], F_SETPIPE_SZ, 65536), 65536);
  }
  ~Pipe() {
    close_reader();
    close(ends[1]);
  }
  void close_reader() {
    if (ends[0] >= 0) close(ends[0]);
    ends[0] = -1;
  }
};

TEST(OutputQueue, NeverBlocksOnStalledReader) {
  Pipe pipe;
  {
    OutputQueue output(pipe.ends[1]);
    EXPECT_FALSE(output.closed());
    std::size_t taken = 0;
    while (taken < 100 && output.offer(std::string(std::size_t(1) << 20, 'x'))) ++taken;
    EXPECT_GE(taken, 16u);
    EXPECT_LE(taken, 18u);
    pipe.close_reader();
    EXPECT_TRUE(output.closed());
  }
}

TEST(OutputQueue, WritesEverythingBeforeItEnds) {
  Pipe pipe;
  {
    OutputQueue output(pipe.ends[1]);
    for (int i = 0; i < 1000; ++i) output.put(std::to_string(i) + "\n");
  }
  std::string expected, got(10'000, '\0');
  for (int i = 0; i < 1000; ++i) expected += std::to_string(i) + "\n";
  got.resize(std::size_t(read(pipe.ends[0], got.data(), got.size())));
  EXPECT_EQ(got, expected);
}

bool is_full(const Pipe& pipe) {
  int bytes = 0;
  return ioctl(pipe.ends[0], FIONREAD, &bytes) == 0 && bytes == fcntl(pipe.ends[0], F_GETPIPE_SZ);
}

// Opens and returns the file descriptors that are free now.
std::set<int> free_descriptors() {
  std::set<int> opened;
  while (opened.size() < 10) opened.insert(dup(STDIN_FILENO));
  return opened;
}

// A pipe that is not read stands for a hung disk. The thread outlives the queue and ends with its
// write().
TEST(OutputQueue, FinishEndsInTimeAndTheThreadKeepsItsFile) {
  Pipe pipe;
  const auto start = Clock::now();
  {
    OutputQueue output(pipe.ends[1]);
    for (int i = 0; i < 10; ++i) output.offer(std::string(100'000, char('a' + i)));
    while (!is_full(pipe)) ASSERT_LT(Clock::now() - start, 30s);
    EXPECT_EQ(output.finish(50ms), ETIMEDOUT);
    EXPECT_FALSE(output.offer("further"));
  }
  close(pipe.ends[1]);
  // The number of the closed descriptor is used again. The thread must not close it.
  const std::set<int> others = free_descriptors();
  EXPECT_TRUE(others.contains(pipe.ends[1]));
  std::string got;
  char block[4096];
  for (ssize_t count; (count = read(pipe.ends[0], block, sizeof block)) > 0;)
    got.append(block, std::size_t(count));
  EXPECT_EQ(got, std::string(100'000, 'a')) << "the text of the write() that was in progress";
  for (const int other : others) EXPECT_EQ(close(other), 0);
  pipe.ends[1] = dup(STDIN_FILENO);
}

TEST(OutputQueue, FinishInTimeWritesEverything) {
  Pipe pipe;
  OutputQueue output(pipe.ends[1]);
  output.put("text");
  EXPECT_EQ(output.finish(10s), 0);
  char got[10];
  EXPECT_EQ(read(pipe.ends[0], got, sizeof got), 4);
}

TEST(OutputQueue, AFullDiskIsAnErrorAndDropsTheRest) {
  const int full = open("/dev/full", O_WRONLY);
  ASSERT_GE(full, 0);
  OutputQueue output(full);
  EXPECT_FALSE(output.closed());
  for (int i = 0; i < 2; ++i) output.put(std::string(OutputQueue::kMaxQueuedBytes, 'x'));
  EXPECT_EQ(output.finish(), ENOSPC);
  EXPECT_TRUE(output.closed());
  EXPECT_EQ(output.finish(1ns), ENOSPC) << "has finished before";
  close(full);
}

// The limit makes write() take a part of the text.
TEST(OutputQueue, ContinuesAfterAShortWriteAndReportsTheError) {
  const test::TestFolder folder;
  const std::string name = folder.path / "file";
  const int file = open(name.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
  ASSERT_GE(file, 0);
  ASSERT_EQ(write(file, "012345678", 9), 9);
  int error = 0;
  {
    OutputQueue output(file);
    const test::FileSizeLimit limit(10);
    output.put("9ab");
    error = output.finish();
  }
  close(file);
  EXPECT_EQ(error, EFBIG);
  EXPECT_EQ(test::text_of(name), "0123456789");
}

TEST(OutputQueue, AReaderThatHasSeenEnoughIsNoError) {
  Pipe pipe;
  OutputQueue output(pipe.ends[1]);
  pipe.close_reader();
  for (int i = 0; i < 3; ++i) output.put("text");
  EXPECT_EQ(output.finish(), 0);
  EXPECT_TRUE(output.closed());
}

TEST(OutputQueue, RefusesAFileThatIsNotOpen) {
  EXPECT_THROW(OutputQueue(-1), std::system_error);
  const int closed = dup(STDIN_FILENO);
  close(closed);
  EXPECT_FALSE(is_broken_pipe(closed));
}

TEST(OutputQueue, AClosedSocketIsABrokenPipe) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  EXPECT_FALSE(is_broken_pipe(ends[1]));
  close(ends[0]);
  EXPECT_TRUE(is_broken_pipe(ends[1]));
  close(ends[1]);
}

}  // namespace
}  // namespace fivepipe::base
