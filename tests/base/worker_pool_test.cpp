#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <set>
#include <string>
#include <thread>

#include "common/base/worker_pool.h"
#include "tests/support/process/stat.h"

namespace fivepipe::base {
namespace {

TEST(WorkerPool, CallsWorkOncePerPieceInEveryRun) {
  for (const int threads : {1, 2, 5}) {
    WorkerPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    for (const int pieces : {0, 1, 2, 3, 1000})
      for (int run = 0; run < 50; ++run) {
        std::vector<std::atomic<int>> done(pieces);
        pool.run(pieces, [&](int piece, int thread) {
          EXPECT_TRUE(thread >= 0 && thread < threads);
          ++done[piece];
        });
        for (const auto& d : done) ASSERT_EQ(d, 1);
      }
  }
}

TEST(WorkerPool, CallsWorkOnceForEachOf100000Pieces) {
  WorkerPool pool(3);
  std::vector<std::atomic<char>> done(100'000);
  pool.run(int(done.size()), [&](int piece, int) { ++done[std::size_t(piece)]; });
  for (const auto& d : done) ASSERT_EQ(d, 1);
}

TEST(WorkerPool, GivesConcurrentCallsDistinctThreadNumbers) {
  WorkerPool pool(4);
  std::vector<std::atomic<int>> inside(4);
  pool.run(2000, [&](int, int thread) {
    EXPECT_EQ(inside[thread].fetch_add(1), 0);
    inside[thread].fetch_sub(1);
  });
}

// Longer than an idle thread polls before it sleeps.
void spin_for_1_ms() {
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - start < std::chrono::milliseconds(1)) {
  }
}

// Each piece waits for all others, so each needs a thread of its own.
TEST(WorkerPool, WakesEveryThreadAndWaitsForTheLastPiece) {
  for (const int threads : {2, 4}) {
    WorkerPool pool(threads);
    for (int round = 0; round < 5; ++round) {
      spin_for_1_ms();
      std::atomic<int> started = 0, done = 0;
      std::atomic<bool> is_alone = false;
      const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
      pool.run(threads, [&](int, int thread) {
        ++started;
        while (started < threads && !is_alone) {
          is_alone = std::chrono::steady_clock::now() > deadline;
          std::this_thread::yield();
        }
        if (thread != 0) spin_for_1_ms();
        ++done;
      });
      ASSERT_EQ(done, threads);
      ASSERT_FALSE(is_alone);
    }
  }
}

// Returns true if all threads of the process but the calling one sleep.
bool all_others_sleep() {
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    if (thread.path().filename() == std::to_string(gettid())) continue;
    if (test::state_in(thread.path() / "stat") != 'S') return false;
  }
  return true;
}

void wait_until_all_others_sleep() {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!all_others_sleep()) ASSERT_LT(std::chrono::steady_clock::now(), deadline);
}

TEST(WorkerPool, ItsThreadsSleepAfterARun) {
  WorkerPool pool(3);
  for (int run = 0; run < 3; ++run) {
    pool.run(10, [](int, int) {});
    wait_until_all_others_sleep();
  }
}

TEST(WorkerPool, DestroysAPoolWhoseThreadsSleep) {
  WorkerPool pool(3);
  wait_until_all_others_sleep();
}

}  // namespace
}  // namespace fivepipe::base
