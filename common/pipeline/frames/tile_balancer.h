// Assigns the tiles of the next frame to reconstruction workers. capture_node decides and sends the
// assignment with the head pose, so that all workers agree, also after a restart of one of them.
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/config/deployment.h"

namespace fivepipe::frames {

class TileBalancer {
 public:
  // The assignment uses the mean cost of each tile over this many frames, because costs are noisy.
  static constexpr int kAveragedFrames = 4;

  // `recon`: the configuration of any recon_node; all have the same split.
  explicit TileBalancer(const config::ReconConfig& recon);

  // Adds the costs of one worker's tiles in a frame, one per element of `tiles`. Returns false and
  // ignores them if the sizes differ, a tile or the worker does not exist, or a cost is negative or
  // NaN.
  bool add(std::uint64_t frame, int worker, std::span<const std::uint16_t> tiles,
           std::span<const float> cost_ms);

  // Returns the worker index for each tile of the next frame, row by row. `workers`: those that
  // take part, at least one. split: frames assigns whole frames round-robin. split: tiles assigns
  // tiles round-robin until the costs of all tiles are known for kAveragedFrames frames, then
  // balances the cost of the workers.
  std::vector<std::uint8_t> next(const std::vector<int>& workers);
  int worker_count() const { return worker_count_; }

 private:
  struct FrameCosts {
    std::vector<float> cost_ms;  // by tile; negative: not reported
    int reported = 0;
  };
  std::vector<double> mean_costs() const;  // by tile; empty: unknown

  int columns_, rows_, worker_count_;
  config::ReconSplit split_;
  bool balance_;
  int current_worker_ = 0;                      // of split: frames
  std::map<std::uint64_t, FrameCosts> frames_;  // the newest frames
};

// Assigns tile (column, row) to worker (column + row) % workers.size() of the list, which spreads
// an object's tiles.
std::vector<std::uint8_t> round_robin_tiles(int columns, int rows, const std::vector<int>& workers);
// Returns 0 to workers - 1.
std::vector<int> all_workers(int workers);

}  // namespace fivepipe::frames
