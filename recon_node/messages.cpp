#include "recon_node/messages.h"

namespace fivepipe::recon {

const fivepipe_v1_HullTile& OutgoingTile::message() {
  messages::borrow(header.depth_m, depth_m);
  messages::borrow(header.bgr, bgr);
  header.empty_cameras._length = header.empty_cameras._maximum =
      std::uint32_t(empty_cameras.size());
  header.empty_cameras._buffer = empty_cameras.empty() ? nullptr : &empty_cameras.front().text;
  header.empty_cameras._release = false;
  return header;
}

const fivepipe_v1_TileCosts& OutgoingCosts::message() {
  messages::borrow(header.tiles, tiles);
  messages::borrow(header.cost_ms, cost_ms);
  return header;
}

OutgoingCosts costs_message(const TileFrame& frame, int worker_index,
                            std::span<const ReconTile> tiles) {
  OutgoingCosts out;
  messages::set_text(out.header.viewer, frame.viewer);
  out.header.worker = std::uint16_t(worker_index);
  out.header.frame = frame.frame;
  out.header.capture_stamp_ns = frame.capture_stamp_ns;
  for (const ReconTile& tile : tiles) {
    out.tiles.push_back(std::uint16_t(tile.tile.index));
    out.cost_ms.push_back(float(1e3 * tile.cost_s));
  }
  return out;
}

OutgoingTile tile_message(const TileFrame& frame, ReconTile tile) {
  OutgoingTile out;
  messages::set_text(out.header.viewer, frame.viewer);
  out.header.tile = std::uint16_t(tile.tile.index);
  out.header.tiles = std::uint16_t(frame.tiles);
  out.header.frame = frame.frame;
  out.header.capture_stamp_ns = frame.capture_stamp_ns;
  out.header.eye_from_world = messages::to_wire(frame.view.camera.camera_from_world);
  out.header.recon = messages::to_wire(frame.view.camera.pinhole);
  out.header.rect = messages::to_wire(tile.tile.rect);
  out.header.covered = messages::to_wire(tile.covered);
  out.depth_m = std::move(tile.depth_m);
  out.bgr = std::move(tile.bgr);
  for (const std::string& camera : frame.empty_cameras)
    messages::set_text(out.empty_cameras.emplace_back().text, camera);
  return out;
}

}  // namespace fivepipe::recon
