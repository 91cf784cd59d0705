#include "render_node/messages.h"

namespace fivepipe {

Received<ReceivedTile> tile_from(const fivepipe_v1_HullTile& message) {
  const auto eye_from_world = pure(message.eye_from_world);
  if (!eye_from_world) return BadMessage{"bad_tile: pose is not finite or not a rotation"};
  ReceivedTile tile;
  tile.frame = message.frame;
  tile.capture_stamp_ns = message.capture_stamp_ns;
  tile.tile = message.tile;
  tile.tiles = message.tiles;
  tile.eye_from_world = *eye_from_world;
  tile.recon = pure(message.recon);
  tile.rect = pure(message.rect);
  tile.covered = pure(message.covered);
  tile.depth_m = span_of(message.depth_m);
  tile.bgr = span_of(message.bgr);
  for (const auto& camera : span_of(message.empty_cameras)) tile.empty_cameras.emplace_back(camera);
  return tile;
}

Received<std::vector<ObjectPose>> poses_from(const fivepipe_v1_VirtualState& message) {
  std::vector<ObjectPose> poses;
  for (const fivepipe_v1_ObjectState& object : span_of(message.objects)) {
    const auto pose = pure(object.world_from_object);
    if (!pose) return BadMessage{"bad_state: " + std::string(object.object) + ": pose is not finite or not a rotation"};
    const auto vertices = span_of(object.vertices_m), warmth = span_of(object.warmth);
    poses.push_back({object.object, *pose, {vertices.begin(), vertices.end()}, {warmth.begin(), warmth.end()}});
  }
  return poses;
}

fivepipe_v1_FrameComposited composited_message(const std::string& viewer, const HullFrame& hull, std::int64_t composited_stamp_ns) {
  fivepipe_v1_FrameComposited message{};
  set_text(message.viewer, viewer);
  message.frame = hull.frame;
  message.capture_stamp_ns = hull.capture_stamp_ns;
  message.composited_stamp_ns = composited_stamp_ns;
  return message;
}

}  // namespace fivepipe
