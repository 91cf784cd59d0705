// Who reconstructs which tile.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <random>

#include "common/pipeline/frames/tile_shares.h"

namespace fivepipe::frames {
namespace {

config::ReconConfig config(int columns, int rows, int shares, bool balance = true,
                           config::ReconSplit split = config::ReconSplit::tiles) {
  config::ReconConfig recon;
  recon.tile_columns = columns, recon.tile_rows = rows, recon.shares = shares,
  recon.balance = balance, recon.split = split;
  return recon;
}

// All shares' costs of a frame, as each reports the tiles that it owned; `silent` reports none.
void add_frame(TileShares& tile_shares, std::uint64_t frame, int shares,
               const std::vector<float>& cost_ms, int silent = -1) {
  const auto owner = tile_shares.next();
  for (int share = 0; share < shares; ++share) {
    if (share == silent) continue;
    std::vector<std::uint16_t> tiles;
    std::vector<float> costs;
    for (std::size_t tile = 0; tile < owner.size(); ++tile)
      if (owner[tile] == share)
        tiles.push_back(std::uint16_t(tile)), costs.push_back(cost_ms[tile]);
    EXPECT_TRUE(tile_shares.add(frame, share, tiles, costs));
  }
}

double worst_share(const std::vector<std::uint8_t>& owner, const std::vector<float>& cost_ms,
                   int shares) {
  std::vector<double> load(std::size_t(shares), 0.0);
  for (std::size_t tile = 0; tile < owner.size(); ++tile) load.at(owner[tile]) += cost_ms[tile];
  return *std::max_element(load.begin(), load.end());
}

TEST(TileShares, ByTurnsUntilCostsAreKnown) {
  TileShares shares(config(4, 3, 2));
  EXPECT_EQ(shares.next(), tiles_by_turns(4, 3, 2));
  for (int frame = 0; frame + 1 < TileShares::kMeanFrames; ++frame)
    add_frame(shares, std::uint64_t(frame), 2, std::vector<float>(12, 0.1f));
  EXPECT_EQ(shares.next(), tiles_by_turns(4, 3, 2));
}

TEST(TileShares, EvenOutWhatTilesCost) {
  std::mt19937_64 random(2);
  for (int n = 2; n <= 4; ++n) {
    std::vector<float> cost;
    for (int tile = 0; tile < 48; ++tile)
      cost.push_back(tile % 8 < 2 ? std::uniform_real_distribution<float>(0.5f, 2)(random)
                                  : 0.01f);  // an object at one side
    TileShares shares(config(8, 6, n));
    for (std::uint64_t frame = 0; frame < 8; ++frame) add_frame(shares, frame, n, cost);
    const double even = std::accumulate(cost.begin(), cost.end(), 0.0) / n,
                 worst = worst_share(shares.next(), cost, n);
    EXPECT_LT(worst, 1.15 * even);
    EXPECT_LT(worst, worst_share(tiles_by_turns(8, 6, n), cost, n));
  }
}

TEST(TileShares, FollowTheObject) {
  std::vector<float> left(12, 0.0f), right(12, 0.0f);
  left[0] = left[4] = 2, right[3] = right[7] = 2;
  TileShares shares(config(4, 3, 2));
  for (std::uint64_t frame = 0; frame < 8; ++frame) add_frame(shares, frame, 2, left);
  EXPECT_EQ(worst_share(shares.next(), left, 2), 2);
  for (std::uint64_t frame = 8; frame < 16; ++frame) add_frame(shares, frame, 2, right);
  EXPECT_EQ(worst_share(shares.next(), right, 2), 2);
}

TEST(TileShares, ByTurnsAgainWhereANodeIsSilent) {
  TileShares shares(config(4, 3, 2));
  std::vector<float> cost(12, 0.0f);
  cost[0] = 5, cost[2] = 5;  // by turns both are of share 0
  for (std::uint64_t frame = 0; frame < 8; ++frame) add_frame(shares, frame, 2, cost);
  EXPECT_NE(shares.next(), tiles_by_turns(4, 3, 2));
  for (std::uint64_t frame = 8; frame < 16; ++frame) add_frame(shares, frame, 2, cost, 1);
  EXPECT_EQ(shares.next(), tiles_by_turns(4, 3, 2));
  for (std::uint64_t frame = 16; frame < 24; ++frame) add_frame(shares, frame, 2, cost);
  EXPECT_NE(shares.next(), tiles_by_turns(4, 3, 2));
}

TEST(TileShares, OrderOfReportsNeverShows) {
  std::mt19937_64 random(3);
  std::vector<std::array<int, 2>> reports;  // frame, share
  for (int frame = 0; frame < 6; ++frame)
    for (int share = 0; share < 2; ++share) reports.push_back({frame, share});
  std::vector<std::vector<std::uint8_t>> answers;
  for (int round = 0; round < 5; ++round) {
    std::shuffle(reports.begin(), reports.end(), random);
    TileShares shares(config(4, 3, 2));
    for (const auto& [frame, share] : reports) {
      std::vector<std::uint16_t> tiles;
      std::vector<float> costs;
      for (int tile = share; tile < 12; tile += 2)
        tiles.push_back(std::uint16_t(tile)), costs.push_back(float(1 + tile * frame % 5));
      EXPECT_TRUE(shares.add(std::uint64_t(frame), share, tiles, costs));
    }
    answers.push_back(shares.next());
  }
  for (const auto& answer : answers) EXPECT_EQ(answer, answers.front());
}

TEST(TileShares, RefuseWhatCannotBe) {
  TileShares shares(config(4, 3, 2));
  const std::vector<std::uint16_t> tiles{0, 11};
  EXPECT_FALSE(shares.add(1, 0, tiles, std::vector<float>{1}));
  EXPECT_FALSE(shares.add(1, 2, tiles, std::vector<float>{1, 2}));
  EXPECT_FALSE(shares.add(1, -1, tiles, std::vector<float>{1, 2}));
  EXPECT_FALSE(shares.add(1, 0, std::vector<std::uint16_t>{12}, std::vector<float>{1}));
  EXPECT_FALSE(
      shares.add(1, 0, tiles, std::vector<float>{1, std::numeric_limits<float>::quiet_NaN()}));
  EXPECT_FALSE(shares.add(1, 0, tiles, std::vector<float>{1, -1}));
}

TEST(TileShares, WholeFramesGoRound) {
  TileShares shares(config(4, 3, 3, true, config::ReconSplit::frames));
  std::vector<int> taken(3);
  for (int frame = 0; frame < 30; ++frame) {
    const auto owner = shares.next();
    ASSERT_EQ(owner.size(), 12u);
    for (const auto o : owner) EXPECT_EQ(o, owner.front());
    ++taken.at(owner.front());
  }
  EXPECT_EQ(taken, (std::vector<int>{10, 10, 10}));
}

TEST(TileShares, BalanceOffMeansByTurns) {
  TileShares shares(config(4, 3, 2, false));
  std::vector<float> cost(12, 0.0f);
  cost[0] = 5;
  for (std::uint64_t frame = 0; frame < 20; ++frame) add_frame(shares, frame, 2, cost);
  EXPECT_EQ(shares.next(), tiles_by_turns(4, 3, 2));
}

}  // namespace
}  // namespace fivepipe::frames
