#include "common/config/mesh/limited_child.h"
#include "tests/support/sanitizer.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <numeric>
#include <stdexcept>
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

}  // namespace
}  // namespace fivepipe::config
