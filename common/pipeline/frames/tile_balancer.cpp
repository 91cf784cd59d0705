#include "common/pipeline/frames/tile_balancer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace fivepipe::frames {
namespace {

// Number of frames with reported costs that are kept. If too few of them are complete, the current
// costs are unknown.
constexpr std::size_t kMaxCostFrames = 8;

}  // namespace

std::vector<std::uint8_t> round_robin_tiles(int columns, int rows,
                                            const std::vector<int>& workers) {
  std::vector<std::uint8_t> owner;
  for (int tile = 0; tile < columns * rows; ++tile)
    owner.push_back(
        std::uint8_t(workers[std::size_t(tile % columns + tile / columns) % workers.size()]));
  return owner;
}

std::vector<int> all_workers(int workers) {
  std::vector<int> all(std::size_t(workers), 0);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

TileBalancer::TileBalancer(const config::ReconConfig& recon)
    : columns_(recon.tile_columns),
      rows_(recon.tile_rows),
      worker_count_(recon.worker_count),
      split_(recon.split),
      balance_(recon.balance) {
  assert(columns_ > 0 && rows_ > 0 && worker_count_ > 0 && worker_count_ <= 256);
}

bool TileBalancer::add(std::uint64_t frame, int worker, std::span<const std::uint16_t> tiles,
                       std::span<const float> cost_ms) {
  const int all = columns_ * rows_;
  if (tiles.size() != cost_ms.size() || worker < 0 || worker >= worker_count_) return false;
  for (std::size_t i = 0; i < tiles.size(); ++i)
    if (tiles[i] >= all || !(cost_ms[i] >= 0 && std::isfinite(cost_ms[i]))) return false;
  FrameCosts& costs = frames_[frame];
  if (costs.cost_ms.empty()) costs.cost_ms.assign(std::size_t(all), -1.0f);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    costs.reported += costs.cost_ms[tiles[i]] < 0;
    costs.cost_ms[tiles[i]] = cost_ms[i];
  }
  while (frames_.size() > kMaxCostFrames) frames_.erase(frames_.begin());
  return true;
}

std::vector<double> TileBalancer::mean_costs() const {
  std::vector<double> sum(std::size_t(columns_ * rows_));
  int frames = 0;
  for (auto f = frames_.rbegin(); f != frames_.rend() && frames < kAveragedFrames; ++f) {
    if (f->second.reported < columns_ * rows_) continue;
    for (std::size_t tile = 0; tile < sum.size(); ++tile) sum[tile] += f->second.cost_ms[tile];
    ++frames;
  }
  if (frames < kAveragedFrames) return {};
  return sum;
}

std::vector<std::uint8_t> TileBalancer::next(const std::vector<int>& workers) {
  assert(!workers.empty());
  if (split_ == config::ReconSplit::frames) {
    const auto next = std::upper_bound(workers.begin(), workers.end(), current_worker_);
    current_worker_ = next == workers.end() ? workers.front() : *next;
    return std::vector<std::uint8_t>(std::size_t(columns_ * rows_), std::uint8_t(current_worker_));
  }
  const std::vector<double> cost = balance_ ? mean_costs() : std::vector<double>{};
  if (cost.empty()) return round_robin_tiles(columns_, rows_, workers);
  // Longest processing time first (Graham, 1969): assigns the tiles by descending cost, each to the
  // worker with the smallest sum. The largest sum is at most 4/3 of the optimum.
  std::vector<std::uint8_t> owner(cost.size());
  std::vector<int> order(owner.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return cost[std::size_t(a)] > cost[std::size_t(b)]; });
  std::vector<double> load(workers.size(), 0.0);
  for (const int tile : order) {
    const auto least = std::min_element(load.begin(), load.end());
    owner[std::size_t(tile)] = std::uint8_t(workers[std::size_t(least - load.begin())]);
    *least += cost[std::size_t(tile)];
  }
  return owner;
}

}  // namespace fivepipe::frames
