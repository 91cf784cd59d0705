// Child processes: what they inherit, what they leave behind, and how their output is read.
#include <fcntl.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include "tests/launch/supervise/supervisor_fixture.h"
#include "tests/support/optional_package.h"
#include "tests/support/process/open_files.h"

using namespace fivepipe;
using namespace fivepipe::test;
using namespace std::chrono_literals;

// Nodes inherit neither the input, nor the open files, nor the signal settings of `fivepipe up`.
TEST_F(SupervisorTest, AChildStartsWithTheDefaultsOfAProcess) {
  int to_stdin[2];
  ASSERT_EQ(pipe(to_stdin), 0);
  ASSERT_EQ(write(to_stdin[1], "typed\n", 6), 6);
  close(to_stdin[1]);
  const int own_stdin = fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 10);
  dup2(to_stdin[0], STDIN_FILENO);
  close(to_stdin[0]);
  std::ofstream(folder / "inherited") << "text";
  std::vector<int> inherited;  // the lowest free numbers, without O_CLOEXEC
  for (int i = 0; i < 3; ++i) inherited.push_back(open((folder / "inherited").c_str(), O_RDONLY));
  sigset_t all, before;
  sigfillset(&all);
  sigprocmask(SIG_SETMASK, &all, &before);
  std::vector<std::pair<int, sighandler_t>> handlers;
  for (const int number : {SIGINT, SIGTERM, SIGPIPE})
    handlers.emplace_back(number, signal(number, SIG_IGN));
  // A test in the background may have started with these ignored, which nodes inherit.
  for (const int number : {SIGHUP, SIGQUIT}) handlers.emplace_back(number, signal(number, SIG_DFL));
  {
    launch::ChildProcess child({"/bin/sh", "-c",
                                "cat; echo to stderr >&2; ls -l /proc/self/fd | grep -c inherited; "
                                "grep -E 'SigBlk|SigIgn' /proc/self/status"},
                               {});
    std::vector<std::string> printed;
    const auto until = Clock::now() + kTimeout;
    for (bool ended = false; !ended && Clock::now() < until;) {
      ended = child.wait_for_end(1ms);
      for (const std::string& line : child.read_lines(ended)) printed.push_back(line);
    }
    EXPECT_EQ(printed, (std::vector<std::string>{"to stderr", "0", "SigBlk:\t0000000000000000",
                                                 "SigIgn:\t0000000000000000"}));
    EXPECT_EQ(child.output_fd(), -1);
  }
  for (const auto& [number, handler] : handlers) signal(number, handler);
  sigprocmask(SIG_SETMASK, &before, nullptr);
  for (const int file : inherited) close(file);
  dup2(own_stdin, STDIN_FILENO);
  close(own_stdin);
}

TEST_F(SupervisorTest, ADestroyedChildLeavesNoOpenFile) {
  int output = -1;
  {
    const launch::ChildProcess child({"/bin/sh", "-c", kRunsForever}, {});
    output = child.output_fd();
    ASSERT_NE(fcntl(output, F_GETFD), -1);
  }
  EXPECT_EQ(fcntl(output, F_GETFD), -1);
}

// The supervisor would otherwise need memory for any length.
TEST_F(SupervisorTest, ALineOfMoreThan64KiBIsSplit) {
  launch::ChildProcess child({"/bin/sh", "-c", "printf '%0300000d\\nlast\\n' 0"}, {});
  std::vector<std::string> pieces;
  const auto until = Clock::now() + kTimeout;
  while (child.output_fd() >= 0 && Clock::now() < until)
    for (const std::string& line : child.read_lines()) pieces.push_back(line);
  ASSERT_GE(pieces.size(), 4u);
  EXPECT_EQ(pieces.back(), "last");
  pieces.pop_back();
  std::size_t bytes = 0;
  constexpr std::size_t kLimit = 64 * 1024, kReadBytes = 16 * 1024;
  for (const std::string& piece : pieces) {
    bytes += piece.size();
    EXPECT_LE(piece.size(), kLimit + kReadBytes);
    if (&piece != &pieces.back()) {
      EXPECT_GT(piece.size(), kLimit);
    }
  }
  EXPECT_EQ(bytes, 300'000u);
}

TEST(ChildProcess, HasOneOpenFileHereUntilItIsKilledAndReaped) {
  const std::size_t before = open_files();
  pid_t pid = 0;
  {
    const launch::ChildProcess child({"/bin/sh", "-c", kRunsForever}, {});
    pid = child.pid();
    EXPECT_EQ(open_files(), before + 1) << "its output";
  }
  EXPECT_EQ(open_files(), before);
  EXPECT_FALSE(exists(pid));
}

TEST(ChildProcess, AProgramThatCannotBeExecutedLeavesNeitherAProcessNorAnOpenFile) {
  while (waitpid(-1, nullptr, WNOHANG) > 0) {
  }
  const std::size_t before = open_files();
  try {
    const launch::ChildProcess child({"/no/such/program"}, {});
    ADD_FAILURE() << "it was started";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), ENOENT);
    EXPECT_STREQ(error.what(), "cannot execute /no/such/program: No such file or directory");
  }
  EXPECT_EQ(open_files(), before);
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

TEST(ChildProcess, NeedsAFileForItsOutput) {
  if (!kCanThrowWithoutFiles) GTEST_SKIP() << "see kCanThrowWithoutFiles";
  const std::exception_ptr thrown =
      thrown_without_files([] { const launch::ChildProcess child({"/bin/true"}, {}); });
  ASSERT_TRUE(thrown) << "it was started";
  try {
    std::rethrow_exception(thrown);
  } catch (const std::system_error& error) {
    EXPECT_STREQ(error.what(), "pipe: Too many open files");
  }
}

// A child with much output does not delay the others.
TEST(ChildProcess, AReadTakesAtMost256KiB) {
  constexpr int kLineBytes = 1024, kLines = 600;
  launch::ChildProcess child({"/bin/sh", "-c", "yes $(printf '%01023d' 0) | head -n 600"}, {});
  if (fcntl(child.output_fd(), F_SETPIPE_SZ, 1 << 20) < 1 << 20)
    FIVEPIPE_SKIP_WITHOUT_PACKAGE(
        "needs a pipe of 1 MiB: raise pipe-max-size and pipe-user-pages-soft");
  int bytes = 0;
  for (const auto until = Clock::now() + kTimeout;
       bytes < kLines * kLineBytes && Clock::now() < until; sched_yield())
    ASSERT_EQ(ioctl(child.output_fd(), FIONREAD, &bytes), 0);
  EXPECT_EQ(bytes, kLines * kLineBytes);
  for (const std::size_t lines : {256u, 256u, 88u}) {
    const std::vector<std::string> read = child.read_lines();
    EXPECT_EQ(read.size(), lines);
    for (const std::string& line : read) ASSERT_EQ(line, std::string(kLineBytes - 1, '0'));
  }
}
