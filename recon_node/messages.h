// HullTile out; TileCosts in and out.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/messages/wire_conversions.h"
#include "recon_node/reconstruct.h"

namespace fivepipe::recon {

struct OutgoingTile {
  fivepipe_v1_HullTile header{};
  std::vector<float> depth_m;
  std::vector<std::uint8_t> bgr;
  struct CameraName {
    char text[33];
  };
  std::vector<CameraName> empty_cameras;
  const fivepipe_v1_HullTile& message();
};

struct TileFrame {
  std::string viewer;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  hull::View view;
  int tiles;  // of the whole view
  std::vector<std::string> empty_cameras;
};
OutgoingTile tile_message(const TileFrame& frame, ReconTile tile);

struct OutgoingCosts {
  fivepipe_v1_TileCosts header{};
  std::vector<std::uint16_t> tiles;
  std::vector<float> cost_ms;
  const fivepipe_v1_TileCosts& message();
};
OutgoingCosts costs_message(const TileFrame& frame, int share, std::span<const ReconTile> tiles);

}  // namespace fivepipe::recon
