// Which reconstruction node takes which tile of the next frame. Decided in one place, where frames
// start, and sent with the head's pose, so that the nodes agree by construction, whoever was
// started anew.
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/config/deployment.h"

namespace fivepipe::frames {

class TileBalancer {
 public:
  // Tiles are shared by the mean of what they cost in the newest frames, so many of them: a tile's
  // cost is noisy.
  static constexpr int kAveragedFrames = 4;

  // By the split of these reconstruction nodes, which is the same in all of them.
  explicit TileBalancer(const config::ReconConfig& recon);

  // What one worker's tiles of a frame cost, each as many as `tiles`. False, and ignored, where
  // sizes differ, a tile or the worker is not there, or a cost is not a number >= 0.
  bool add(std::uint64_t frame, int worker, std::span<const std::uint16_t> tiles,
           std::span<const float> cost_ms);
  void clear();

  // The worker that owns each tile of the next frame, row by row. Whole frames by turns, or tiles:
  // by turns until costs are known of all of them in enough frames, then so that all workers cost
  // the same.
  std::vector<std::uint8_t> next();

 private:
  struct FrameCosts {
    std::vector<float> cost_ms;  // by tile; negative: not reported
    int reported = 0;
  };
  std::vector<double> mean_costs() const;  // empty: not known

  int columns_, rows_, worker_count_;
  config::ReconSplit split_;
  bool balance_;
  int current_worker_ = 0;
  std::map<std::uint64_t, FrameCosts> frames_;  // the newest
};

// (column + row) % workers: an object's tiles spread over the nodes.
std::vector<std::uint8_t> round_robin_tiles(int columns, int rows, int workers);

}  // namespace fivepipe::frames
