// Builds HullTile and TileCosts messages.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/messages/wire_conversions.h"
#include "recon_node/reconstruct.h"

namespace fivepipe::recon {

// A HullTile message and the storage of its sequences.
struct OutgoingTile {
  fivepipe_v1_HullTile header{};
  std::vector<float> depth_m;
  std::vector<std::uint8_t> bgr;
  struct CameraName {
    char text[33];
  };
  std::vector<CameraName> empty_cameras;
  // Returns the message, which refers to the members above. Call after the last change to them.
  const fivepipe_v1_HullTile& message();
};

// The fields that all tiles of a frame share.
struct TileFrame {
  std::string viewer;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  hull::View view;
  int tiles;  // number of tiles of the whole view
  std::vector<std::string> empty_cameras;
};
OutgoingTile tile_message(const TileFrame& frame, ReconTile tile);

// A TileCosts message and the storage of its sequences.
struct OutgoingCosts {
  fivepipe_v1_TileCosts header{};
  std::vector<std::uint16_t> tiles;
  std::vector<float> cost_ms;
  const fivepipe_v1_TileCosts& message();
};
OutgoingCosts costs_message(const TileFrame& frame, int worker_index,
                            std::span<const ReconTile> tiles);

}  // namespace fivepipe::recon
