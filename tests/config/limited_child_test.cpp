#include "common/config/mesh/limited_child.h"
#include "tests/support/optional_package.h"
#include "tests/support/process/open_files.h"
#include "tests/support/process/stat.h"
#include "tests/support/sanitizer.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <numeric>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace fivepipe::config {
namespace {

constexpr std::size_t kMemory_bytes = 64 << 20;
constexpr ChildLimits kLimits{1, 30, kMemory_bytes};

std::string failure_of(const std::function<std::string()>& function) {
  const ChildResult result = call_in_child(function, kLimits);
  EXPECT_EQ(result.bytes, "");
  return result.failure;
}

// Adds numbers until the CPU time limit. volatile: the loop has an effect.
std::string add_for_ever() {
  for (volatile unsigned sum = 0;;) sum = sum + 1;
}

TEST(LimitedChild, ReturnsTheResult) {
  std::string bytes(5 << 20, '\0');  // more than a pipe holds
  std::iota(bytes.begin(), bytes.end(), '\0');
  const ChildResult result = call_in_child([&] { return bytes; }, kLimits);
  EXPECT_EQ(result.failure, "");
  EXPECT_TRUE(result.bytes == bytes);
  EXPECT_EQ(call_in_child([] { return ""; }, kLimits).bytes, "");
}

TEST(LimitedChild, ReportsHowTheFunctionFails) {
  EXPECT_EQ(failure_of([]() -> std::string { throw std::runtime_error("no mesh"); }),
            "fails: no mesh");
  EXPECT_EQ(failure_of([]() -> std::string { _exit(7); }), "ends with exit code 7");
}

TEST(LimitedChild, ACrashEndsTheChildAlone) {
  for (const int signal : {SIGSEGV, SIGABRT})
    EXPECT_EQ(failure_of([signal] {
                raise(signal);
                return std::string("unreachable");
              }),
              "crashes (signal " + std::to_string(signal) + ")");
}

// Ctrl-C reaches all processes of the terminal. The caller decides what it ends.
TEST(LimitedChild, AnInterruptDoesNotLookLikeACrash) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const ChildResult result = call_in_child(
        [signal] {
          kill(getpid(), signal);
          return std::string("x");
        },
        kLimits);
    EXPECT_EQ(result.failure, "");
    EXPECT_EQ(result.bytes, "x");
  }
}

TEST(LimitedChild, AnEndlessLoopEndsAtTheTimeLimit) {
  EXPECT_EQ(failure_of(add_for_ever), "takes too long");
}

TEST(LimitedChild, WaitingForEverEndsAtTheTimeLimit) {
  const auto wait_for_ever = [] {
    while (true) pause();
    return std::string();
  };
  EXPECT_EQ(call_in_child(wait_for_ever, {1, 1, kMemory_bytes}).failure, "takes too long");
}

// A sanitizer's allocator ends the process instead of throwing std::bad_alloc.
TEST(LimitedChild, MemoryIsLimited) {
  const auto allocate = [] { return std::string(2 * kMemory_bytes, 'x').substr(0, 1); };
  if (test::kHasSanitizer)
    EXPECT_NE(failure_of(allocate), "");
  else
    EXPECT_EQ(failure_of(allocate), "needs too much memory");
}

TEST(LimitedChild, TheChildCanRaiseItsLimits) {
  const ChildResult result = call_in_child(
      [] {
        raise_own_limits({5, 50, 4 * kMemory_bytes});
        std::string bytes(2 * kMemory_bytes, 'x');
        timespec used{};
        do {
          clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
        } while (used.tv_sec < 1 || used.tv_nsec < 300'000'000);  // more than the 1 s before
        return bytes.substr(0, 3);
      },
      kLimits);
  EXPECT_EQ(result.failure, "");
  EXPECT_EQ(result.bytes, "xxx");
}

rlimit limit_of(__rlimit_resource resource) {
  rlimit limit{};
  getrlimit(resource, &limit);
  return limit;
}

// Core size, CPU time [s], elapsed time [s] and memory in addition to the used one [MiB].
std::string limits_here() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const std::size_t used_bytes = pages * std::size_t(sysconf(_SC_PAGESIZE));
  const std::int64_t more_mib =
      (std::int64_t(limit_of(RLIMIT_AS).rlim_cur) - std::int64_t(used_bytes)) >> 20;
  return std::to_string(limit_of(RLIMIT_CORE).rlim_cur) + ' ' +
         std::to_string(limit_of(RLIMIT_CPU).rlim_cur) + ' ' + std::to_string(alarm(0)) + ' ' +
         std::to_string(more_mib);
}

struct LimitsHere {
  int core = -1, cpu_s = -1, elapsed_s = -1, more_mib = -1;
};
LimitsHere limits_in_child(const std::function<void()>& first) {
  const ChildResult result = call_in_child(
      [&] {
        first();
        return limits_here();
      },
      {7, 700, std::size_t(1) << 30});
  EXPECT_EQ(result.failure, "");
  LimitsHere limits;
  EXPECT_EQ(std::sscanf(result.bytes.c_str(), "%d %d %d %d", &limits.core, &limits.cpu_s,
                        &limits.elapsed_s, &limits.more_mib),
            4);
  return limits;
}

// Tolerance: the child uses at most 100 MiB and 100 s before it reads its limits.
TEST(LimitedChild, HasTheLimitsOfTheCallAndThoseThatItAdds) {
  const rlimit core_before = limit_of(RLIMIT_CORE);
  const rlimit core{core_before.rlim_max, core_before.rlim_max};
  setrlimit(RLIMIT_CORE, &core);
  const LimitsHere of_call = limits_in_child([] {}),
                   raised = limits_in_child([] {
                     raise_own_limits({5, 500, std::size_t(1) << 30});
                   }),
                   at_hard_limit = limits_in_child([] {
                     const rlimit cpu{7, 9};
                     setrlimit(RLIMIT_CPU, &cpu);
                     raise_own_limits({5, 500, std::size_t(1) << 30});
                   });
  setrlimit(RLIMIT_CORE, &core_before);
  EXPECT_EQ(of_call.core, 0);
  EXPECT_EQ(of_call.cpu_s, 7);
  EXPECT_GT(of_call.elapsed_s, 600);
  EXPECT_LE(of_call.elapsed_s, 700);
  EXPECT_NEAR(of_call.more_mib, 1024, 100);
  EXPECT_EQ(raised.cpu_s, 12);
  EXPECT_GT(raised.elapsed_s, 1100);
  EXPECT_LE(raised.elapsed_s, 1200);
  EXPECT_NEAR(raised.more_mib, 2048, 100);
  EXPECT_EQ(at_hard_limit.cpu_s, 9);
}

TEST(LimitedChild, EndsAtItsSignalsEvenIfTheCallerIgnoresAndBlocksThem) {
  sigset_t all, before;
  sigfillset(&all);
  for (const int signal : {SIGABRT, SIGALRM, SIGBUS, SIGFPE, SIGILL, SIGPIPE, SIGSEGV, SIGXCPU}) {
    const auto handler = std::signal(signal, SIG_IGN);
    sigprocmask(SIG_BLOCK, &all, &before);
    const std::string failure = failure_of([signal] {
      raise(signal);
      return std::string("unreachable");
    });
    sigprocmask(SIG_SETMASK, &before, nullptr);
    std::signal(signal, handler);
    EXPECT_EQ(failure, signal == SIGALRM || signal == SIGXCPU
                           ? "takes too long"
                           : "crashes (signal " + std::to_string(signal) + ")");
  }
}

TEST(LimitedChild, ItsTextIsDropped) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const ChildResult result = call_in_child(
      [] {
        const bool is_written =
            write(STDOUT_FILENO, "text", 4) == 4 && write(STDERR_FILENO, "error", 5) == 5;
        return std::string(is_written ? "written" : "not written");
      },
      kLimits);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(result.bytes, "written");
}

void close_all_files() {
  for (int file = STDERR_FILENO + 1; file < 1024; ++file) close(file);
}

TEST(LimitedChild, AResultThatItCannotWriteIsAFailure) {
  EXPECT_TRUE(failure_of([] {
                close_all_files();
                return std::string("x");
              }).starts_with("ends with exit code "));
}

std::string error_of_call() {
  try {
    return "no error: " + call_in_child([] { return "x"; }, kLimits).bytes;
  } catch (const std::system_error& error) {
    return error.what();
  }
}

TEST(LimitedChild, LeavesNoFileOpen) {
  const std::size_t before = test::open_files();
  EXPECT_EQ(call_in_child([] { return "x"; }, kLimits).bytes, "x");
  failure_of([]() -> std::string { _exit(7); });
  EXPECT_EQ(test::open_files(), before);
}

TEST(LimitedChild, WithoutAPipeItIsAnErrorOfTheSystem) {
  if (!test::kCanThrowWithoutFiles) GTEST_SKIP() << "see kCanThrowWithoutFiles";
  const std::size_t before = test::open_files();
  const std::exception_ptr thrown =
      test::thrown_without_files([] { call_in_child([] { return "x"; }, kLimits); });
  ASSERT_TRUE(thrown);
  try {
    std::rethrow_exception(thrown);
  } catch (const std::system_error& error) {
    EXPECT_STREQ(error.what(), "pipe: Too many open files");
  }
  EXPECT_EQ(test::open_files(), before);
}

// RLIMIT_NPROC does not apply to root, so the child switches to another user.
TEST(LimitedChild, WithoutAProcessItIsAnErrorOfTheSystem) {
  const std::string still_root = "still root";
  const ChildResult result = call_in_child(
      [&] {
        const rlimit no_processes{0, 0};
        setrlimit(RLIMIT_NPROC, &no_processes);
        if (geteuid() == 0 && setresuid(65534, 65534, 65534) != 0) return still_root;
        const std::size_t before = test::open_files();
        const std::string error = error_of_call();
        return error + ", " + std::to_string(test::open_files() - before);
      },
      kLimits);
  if (result.bytes == still_root)
    FIVEPIPE_SKIP_WITHOUT_PACKAGE("root cannot become another user: needs CAP_SETUID, uid 65534");
  EXPECT_EQ(result.bytes, "fork: Resource temporarily unavailable, 0");
}

// The pipe ends when all processes that can write to it have ended.
TEST(LimitedChild, EndsWithItsCaller) {
  std::array<int, 2> alive{};
  ASSERT_EQ(pipe(alive.data()), 0);
  const pid_t caller = fork();
  if (caller == 0) {
    call_in_child(
        [&] {
          if (write(alive[1], "x", 1) == 1)
            while (true) pause();
          return std::string();
        },
        {1000, 1000, kMemory_bytes});
    _exit(0);
  }
  close(alive[1]);
  char got = 0;
  EXPECT_EQ(read(alive[0], &got, 1), 1);
  kill(caller, SIGKILL);
  EXPECT_EQ(waitpid(caller, nullptr, 0), caller);
  pollfd end{alive[0], POLLIN, 0};
  EXPECT_EQ(poll(&end, 1, 20'000), 1);
  EXPECT_EQ(read(alive[0], &got, 1), 0);
  close(alive[0]);
}

// Counts the signals that interrupted the caller. The child sees the same memory.
std::atomic<int>* interruptions = nullptr;

// In the child: interrupts its caller `times` while that waits in a call of the system.
void interrupt_the_caller(int times) {
  const std::string stat = "/proc/" + std::to_string(getppid()) + "/stat";
  for (int done = 0; done < times; ++done) {
    const int before = *interruptions;
    while (test::state_in(stat) != 'S') {
    }
    kill(getppid(), SIGUSR1);
    while (*interruptions == before) {
    }
  }
}

TEST(LimitedChild, SignalsDoNotEndTheWaitForIt) {
  void* shared = mmap(nullptr, sizeof *interruptions, PROT_READ | PROT_WRITE,
                      MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  interruptions = new (shared) std::atomic<int>(0);
  struct sigaction count {
  }, before{};
  count.sa_handler = [](int) { ++*interruptions; };  // without SA_RESTART
  sigaction(SIGUSR1, &count, &before);
  const ChildLimits limits{20, 200, kMemory_bytes};
  const ChildResult result = call_in_child(
      [] {
        interrupt_the_caller(3);
        return std::string("x");
      },
      limits);
  EXPECT_EQ(result.failure, "");
  EXPECT_EQ(result.bytes, "x");
  // Without a pipe to read from, the caller waits for the end of the process.
  EXPECT_EQ(call_in_child(
                [] {
                  close_all_files();
                  interrupt_the_caller(10);
                  _exit(7);
                  return "";
                },
                limits)
                .failure,
            "ends with exit code 7");
  EXPECT_EQ(*interruptions, 13);
  sigaction(SIGUSR1, &before, nullptr);
  munmap(shared, sizeof *interruptions);
}

}  // namespace
}  // namespace fivepipe::config
