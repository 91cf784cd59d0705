// Which reconstruction node takes which tile: by what the tiles cost some frames ago, so that all are done at the same time.
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace fivepipe {

// A pure function of the costs heard, so that nodes that heard the same agree without talking. For frame f only costs of frames up to
// f - kLag_frames count: those are long composited, and heard by all. A node that starts anew shares by turns, until it has heard
// enough; for so many frames tiles may be missing, or there twice.
class TileBalance {
 public:
  // More than are ever in flight (capture_node keeps to 3), and room for messages on their way.
  static constexpr std::uint64_t kLag_frames = 12;
  // Costs are the mean over so many frames: a tile's cost is noisy.
  static constexpr int kMean_frames = 4;

  // All > 0. Without `balanced`, always by turns.
  TileBalance(int columns, int rows, int shares, bool balanced);

  // What one share's tiles of a frame cost, each as many as `tiles`; sizes differ or a tile is out of range: ignored, and false.
  bool add(std::uint64_t frame, int share, std::span<const std::uint16_t> tiles, std::span<const float> cost_ms);
  void clear();

  // The share that owns each tile of a frame. By turns, (column + row) % shares, until costs of enough frames are known.
  std::vector<int> owners(std::uint64_t frame) const;

 private:
  struct FrameCosts {
    std::vector<float> cost_ms;  // by tile, negative: not heard
    int heard = 0;
  };
  std::vector<double> mean_costs(std::uint64_t newest) const;  // empty: too few frames

  int columns_, rows_, shares_;
  bool balanced_;
  std::map<std::uint64_t, FrameCosts> frames_;
};

}  // namespace fivepipe
