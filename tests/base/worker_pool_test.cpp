#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <thread>

#include "common/base/worker_pool.h"

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

TEST(WorkerPool, DestroysAPoolWhoseThreadsSleep) {
  WorkerPool pool(3);
  // Whether they sleep cannot be observed. They do after kSpinTime, which is a thousandth of this.
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

}  // namespace
}  // namespace fivepipe::base
