#include <gtest/gtest.h>

#include <set>

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

TEST(WorkerPool, DestroysAnUnusedPool) { WorkerPool pool(3); }

}  // namespace
}  // namespace fivepipe::base
