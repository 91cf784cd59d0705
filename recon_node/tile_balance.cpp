#include "recon_node/tile_balance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace fivepipe {
namespace {

// Kept: enough that the frames that count are there, whatever number of them has not been heard of in full.
constexpr std::size_t kFramesKept = 64;

}  // namespace

TileBalance::TileBalance(int columns, int rows, int shares, bool balanced) : columns_(columns), rows_(rows), shares_(shares), balanced_(balanced) {
  assert(columns > 0 && rows > 0 && shares > 0);
}

bool TileBalance::add(std::uint64_t frame, int share, std::span<const std::uint16_t> tiles, std::span<const float> cost_ms) {
  const int all = columns_ * rows_;
  if (tiles.size() != cost_ms.size() || share < 0 || share >= shares_) return false;
  for (std::size_t i = 0; i < tiles.size(); ++i)
    if (tiles[i] >= all || !(cost_ms[i] >= 0 && std::isfinite(cost_ms[i]))) return false;
  FrameCosts& costs = frames_[frame];
  if (costs.cost_ms.empty()) costs.cost_ms.assign(std::size_t(all), -1.0f);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    costs.heard += costs.cost_ms[tiles[i]] < 0;
    costs.cost_ms[tiles[i]] = cost_ms[i];
  }
  while (frames_.size() > kFramesKept) frames_.erase(frames_.begin());
  return true;
}

void TileBalance::clear() { frames_.clear(); }

std::vector<double> TileBalance::mean_costs(std::uint64_t newest) const {
  std::vector<double> sum(std::size_t(columns_ * rows_), 0.0);
  int frames = 0;
  for (auto f = frames_.upper_bound(newest); f != frames_.begin() && frames < kMean_frames;) {
    --f;
    if (f->second.heard < columns_ * rows_) continue;
    for (std::size_t tile = 0; tile < sum.size(); ++tile) sum[tile] += f->second.cost_ms[tile];
    ++frames;
  }
  if (frames < kMean_frames) return {};
  return sum;
}

std::vector<int> TileBalance::owners(std::uint64_t frame) const {
  std::vector<int> owner(std::size_t(columns_ * rows_));
  const std::vector<double> cost = balanced_ && shares_ > 1 && frame >= kLag_frames ? mean_costs(frame - kLag_frames) : std::vector<double>{};
  if (cost.empty()) {
    for (int tile = 0; tile < columns_ * rows_; ++tile) owner[std::size_t(tile)] = (tile % columns_ + tile / columns_) % shares_;
    return owner;
  }
  // Dearest first, each to whom has least so far (longest processing time first; Graham, 1969): within a third of the best, and here
  // within a cheap tile of even.
  std::vector<int> order(owner.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return cost[std::size_t(a)] > cost[std::size_t(b)]; });
  std::vector<double> load(std::size_t(shares_), 0.0);
  for (const int tile : order) {
    const auto least = std::min_element(load.begin(), load.end());
    owner[std::size_t(tile)] = int(least - load.begin());
    *least += cost[std::size_t(tile)];
  }
  return owner;
}

}  // namespace fivepipe
