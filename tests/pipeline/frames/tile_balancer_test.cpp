// The assignment of tiles to reconstruction workers.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include "common/pipeline/frames/tile_balancer.h"

namespace fivepipe::frames {
namespace {

config::ReconConfig config(int columns, int rows, int workers, bool balance = true,
                           config::ReconSplit split = config::ReconSplit::tiles) {
  config::ReconConfig recon;
  recon.tile_columns = columns, recon.tile_rows = rows, recon.worker_count = workers,
  recon.balance = balance, recon.split = split;
  return recon;
}

std::vector<std::uint8_t> next(TileBalancer& balancer) {
  return balancer.next(all_workers(balancer.worker_count()));
}

// Adds the costs of a frame. Each worker reports the tiles that it owns; `silent` reports none.
void add_frame(TileBalancer& tile_balancer, std::uint64_t frame, int workers,
               const std::vector<float>& cost_ms, int silent = -1) {
  const auto owner = next(tile_balancer);
  for (int worker = 0; worker < workers; ++worker) {
    if (worker == silent) continue;
    std::vector<std::uint16_t> tiles;
    std::vector<float> costs;
    for (std::size_t tile = 0; tile < owner.size(); ++tile)
      if (owner[tile] == worker)
        tiles.push_back(std::uint16_t(tile)), costs.push_back(cost_ms[tile]);
    EXPECT_TRUE(tile_balancer.add(frame, worker, tiles, costs));
  }
}

double worst_load(const std::vector<std::uint8_t>& owner, const std::vector<float>& cost_ms,
                  int workers) {
  std::vector<double> load(std::size_t(workers), 0.0);
  for (std::size_t tile = 0; tile < owner.size(); ++tile) load.at(owner[tile]) += cost_ms[tile];
  return *std::max_element(load.begin(), load.end());
}

TEST(RoundRobinTiles, AssignsDiagonals) {
  EXPECT_EQ(round_robin_tiles(4, 3, {0, 1}),
            (std::vector<std::uint8_t>{0, 1, 0, 1, 1, 0, 1, 0, 0, 1, 0, 1}));
  EXPECT_EQ(round_robin_tiles(2, 4, {0, 1, 2}),
            (std::vector<std::uint8_t>{0, 1, 1, 2, 2, 0, 0, 1}));
}

TEST(TileBalancer, RoundRobinUntilCostsAreKnown) {
  TileBalancer balancer(config(4, 3, 2));
  EXPECT_EQ(next(balancer), round_robin_tiles(4, 3, {0, 1}));
  for (int frame = 0; frame + 1 < TileBalancer::kAveragedFrames; ++frame)
    add_frame(balancer, std::uint64_t(frame), 2, std::vector<float>(12, 0.1f));
  EXPECT_EQ(next(balancer), round_robin_tiles(4, 3, {0, 1}));
}

TEST(TileBalancer, BalancesTileCosts) {
  std::mt19937_64 random(2);
  for (int n = 2; n <= 4; ++n) {
    std::vector<float> cost;
    for (int tile = 0; tile < 48; ++tile)
      cost.push_back(tile % 8 < 2 ? std::uniform_real_distribution<float>(0.5f, 2)(random)
                                  : 0.01f);  // the object covers one side
    TileBalancer balancer(config(8, 6, n));
    for (std::uint64_t frame = 0; frame < 8; ++frame) add_frame(balancer, frame, n, cost);
    const double even = std::accumulate(cost.begin(), cost.end(), 0.0) / n,
                 worst = worst_load(next(balancer), cost, n);
    EXPECT_LT(worst, 1.15 * even);
    EXPECT_LT(worst, worst_load(round_robin_tiles(8, 6, all_workers(n)), cost, n));
  }
}

TEST(TileBalancer, TilesOfEqualCostAreAssignedInTheirOrder) {
  TileBalancer balancer(config(4, 3, 3));
  for (std::uint64_t frame = 0; frame < TileBalancer::kAveragedFrames; ++frame)
    add_frame(balancer, frame, 3, std::vector<float>(12, 1.0f));
  EXPECT_EQ(next(balancer), (std::vector<std::uint8_t>{0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2}));
}

TEST(TileBalancer, AdaptsToMovingObject) {
  std::vector<float> left(12, 0.0f), right(12, 0.0f);
  left[0] = left[4] = 2, right[3] = right[7] = 2;
  TileBalancer balancer(config(4, 3, 2));
  for (std::uint64_t frame = 0; frame < 8; ++frame) add_frame(balancer, frame, 2, left);
  EXPECT_EQ(worst_load(next(balancer), left, 2), 2);
  for (std::uint64_t frame = 8; frame < 16; ++frame) add_frame(balancer, frame, 2, right);
  EXPECT_EQ(worst_load(next(balancer), right, 2), 2);
}

TEST(TileBalancer, RoundRobinWhenAWorkerReportsNoCosts) {
  TileBalancer balancer(config(4, 3, 2));
  std::vector<float> cost(12, 0.0f);
  cost[0] = 5, cost[2] = 5;  // round-robin assigns both to worker 0
  for (std::uint64_t frame = 0; frame < 8; ++frame) add_frame(balancer, frame, 2, cost);
  EXPECT_NE(next(balancer), round_robin_tiles(4, 3, {0, 1}));
  for (std::uint64_t frame = 8; frame < 16; ++frame) add_frame(balancer, frame, 2, cost, 1);
  EXPECT_EQ(next(balancer), round_robin_tiles(4, 3, {0, 1}));
  for (std::uint64_t frame = 16; frame < 24; ++frame) add_frame(balancer, frame, 2, cost);
  EXPECT_NE(next(balancer), round_robin_tiles(4, 3, {0, 1}));
}

// The newest 8 frames count, and 4 of them must be complete.
TEST(TileBalancer, BalancesWhileFourOfTheNewestEightFramesAreComplete) {
  TileBalancer balancer(config(4, 3, 2));
  std::vector<float> cost(12, 0.0f);
  cost[0] = 5, cost[2] = 5;
  std::uint64_t frame = 0;
  while (frame < 3) add_frame(balancer, frame++, 2, cost);
  EXPECT_EQ(next(balancer), round_robin_tiles(4, 3, {0, 1}));
  add_frame(balancer, frame++, 2, cost);
  EXPECT_NE(next(balancer), round_robin_tiles(4, 3, {0, 1}));
  while (frame < 8) add_frame(balancer, frame++, 2, cost, 1);
  EXPECT_NE(next(balancer), round_robin_tiles(4, 3, {0, 1}));
  add_frame(balancer, frame++, 2, cost, 1);
  EXPECT_EQ(next(balancer), round_robin_tiles(4, 3, {0, 1}));
}

TEST(TileBalancer, UsesTheCostsOfTheNewestFourFrames) {
  std::vector<float> first(12, 0.0f), later(12, 0.0f);
  first[0] = first[1] = 100;
  later[0] = 3, later[1] = 2, later[2] = 2;
  TileBalancer with_first(config(4, 3, 2)), without(config(4, 3, 2));
  add_frame(with_first, 0, 2, first);
  for (std::uint64_t frame = 1; frame < 5; ++frame) {
    add_frame(with_first, frame, 2, later);
    add_frame(without, frame, 2, later);
  }
  EXPECT_EQ(next(with_first), next(without));
  EXPECT_EQ(worst_load(next(with_first), later, 2), 4);
}

TEST(TileBalancer, ARepeatedReportDoesNotReplaceThatOfAnotherWorker) {
  TileBalancer balancer(config(4, 3, 2));
  std::vector<std::uint16_t> tiles;
  for (std::uint16_t tile = 0; tile < 6; ++tile) tiles.push_back(tile);
  for (std::uint64_t frame = 0; frame < 4; ++frame)
    for (int report = 0; report < 2; ++report)
      EXPECT_TRUE(balancer.add(frame, 0, tiles, std::vector<float>{5, 0, 0.5f, 0, 0, 0}));
  EXPECT_EQ(next(balancer), round_robin_tiles(4, 3, {0, 1}));
}

TEST(TileBalancer, ResultIsIndependentOfReportOrder) {
  std::mt19937_64 random(3);
  std::vector<std::array<int, 2>> reports;  // frame, worker
  for (int frame = 0; frame < 6; ++frame)
    for (int worker = 0; worker < 2; ++worker) reports.push_back({frame, worker});
  std::vector<std::vector<std::uint8_t>> answers;
  for (int round = 0; round < 5; ++round) {
    std::shuffle(reports.begin(), reports.end(), random);
    TileBalancer balancer(config(4, 3, 2));
    for (const auto& [frame, worker] : reports) {
      std::vector<std::uint16_t> tiles;
      std::vector<float> costs;
      for (int tile = worker; tile < 12; tile += 2)
        tiles.push_back(std::uint16_t(tile)), costs.push_back(float(1 + tile * frame % 5));
      EXPECT_TRUE(balancer.add(std::uint64_t(frame), worker, tiles, costs));
    }
    answers.push_back(next(balancer));
  }
  for (const auto& answer : answers) EXPECT_EQ(answer, answers.front());
}

TEST(TileBalancer, RejectsInvalidCosts) {
  TileBalancer balancer(config(4, 3, 2));
  const std::vector<std::uint16_t> tiles{0, 11};
  EXPECT_FALSE(balancer.add(1, 0, tiles, std::vector<float>{1}));
  EXPECT_FALSE(balancer.add(1, 2, tiles, std::vector<float>{1, 2}));
  EXPECT_FALSE(balancer.add(1, -1, tiles, std::vector<float>{1, 2}));
  EXPECT_FALSE(balancer.add(1, 0, std::vector<std::uint16_t>{12}, std::vector<float>{1}));
  EXPECT_FALSE(
      balancer.add(1, 0, tiles, std::vector<float>{1, std::numeric_limits<float>::quiet_NaN()}));
  EXPECT_FALSE(balancer.add(1, 0, tiles, std::vector<float>{1, -1}));
}

TEST(TileBalancer, WholeFramesAreRoundRobin) {
  TileBalancer balancer(config(4, 3, 3, true, config::ReconSplit::frames));
  std::vector<int> taken(3);
  for (int frame = 0; frame < 30; ++frame) {
    const auto owner = next(balancer);
    ASSERT_EQ(owner.size(), 12u);
    for (const auto o : owner) EXPECT_EQ(o, owner.front());
    EXPECT_EQ(owner.front(), (frame + 1) % 3);
    ++taken.at(owner.front());
  }
  EXPECT_EQ(taken, (std::vector<int>{10, 10, 10}));
}

TEST(TileBalancer, AssignsTilesToTheWorkersThatTakePart) {
  const std::vector<int> workers{0, 2};
  EXPECT_EQ(round_robin_tiles(4, 3, workers),
            (std::vector<std::uint8_t>{0, 2, 0, 2, 2, 0, 2, 0, 0, 2, 0, 2}));
  TileBalancer balancer(config(4, 3, 3));
  EXPECT_EQ(balancer.next(workers), round_robin_tiles(4, 3, workers));
  std::vector<float> cost(12, 0.0f);
  cost[0] = cost[2] = 5;  // round-robin assigns both to worker 0
  for (std::uint64_t frame = 0; frame < 8; ++frame) add_frame(balancer, frame, 3, cost);
  const std::vector<std::uint8_t> owners = balancer.next(workers);
  EXPECT_EQ(std::set<std::uint8_t>(owners.begin(), owners.end()), (std::set<std::uint8_t>{0, 2}));
  EXPECT_NE(owners[0], owners[2]);
  TileBalancer whole(config(4, 3, 3, true, config::ReconSplit::frames));
  std::vector<int> order;
  for (int frame = 0; frame < 4; ++frame) order.push_back(whole.next(workers).front());
  EXPECT_EQ(order, (std::vector<int>{2, 0, 2, 0}));
  EXPECT_EQ(whole.next({1}).front(), 1);
  EXPECT_EQ(next(whole).front(), 2);
}

TEST(TileBalancer, RoundRobinWithoutBalancing) {
  TileBalancer balancer(config(4, 3, 2, false));
  std::vector<float> cost(12, 0.0f);
  cost[0] = 5;
  for (std::uint64_t frame = 0; frame < 20; ++frame) add_frame(balancer, frame, 2, cost);
  EXPECT_EQ(next(balancer), round_robin_tiles(4, 3, {0, 1}));
}

}  // namespace
}  // namespace fivepipe::frames
