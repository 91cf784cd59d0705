// Settings of a reconstruction node.
#pragma once
#include "common/hull/hull.h"

namespace fivepipe::config {

// automatic: cpu. sweep: the paper's plane sweep, an approximation.
enum class HullBackend { automatic, cpu, gl, sweep };

// Largest number of tiles of a frame, of all its views together: each is a key of topic HullTile,
// and a reader accepts as many keys from one writer.
inline constexpr int kMaxTilesPerFrame = 4096;

// How the reconstruction nodes divide the work. tiles: each node reconstructs some tiles of every
// frame (low latency). frames: each node reconstructs whole frames, round-robin (high rate).
enum class ReconSplit { tiles, frames };

struct ReconConfig {
  HullBackend backend = HullBackend::automatic;
  int threads = 1;        // of backend cpu
  int sweep_planes = 64;  // of backend sweep: number of depth planes
  // These must be the same in all reconstruction nodes:
  int tile_columns = 8, tile_rows = 6;  // tiles of the view
  int worker_count = 1;                 // number of reconstruction nodes
  ReconSplit split = ReconSplit::tiles;
  // Only for split `tiles`: assigns tiles by their cost in recent frames; false: round-robin.
  bool balance = true;

  int worker_index = 0;           // this node's index, 0 to worker_count - 1
  hull::HullRule hull_rule = {};  // of the deployment
  bool coverage = false;          // of the deployment: sub-pixel silhouettes
};

}  // namespace fivepipe::config
