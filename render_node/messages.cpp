#include "render_node/messages.h"

#include <algorithm>

#include "common/config/recon_config.h"
#include "common/pipeline/bus/topics.h"

namespace fivepipe::render {

// Otherwise a reader would refuse tiles of a valid frame.
static_assert(config::kMaxTilesPerFrame <= bus::topics::HullTile::max_keys);

messages::Received<ReceivedTile> tile_from(const fivepipe_v1_HullTile& message,
                                           const config::Rig& rig) {
  const auto eye_from_world = messages::from_wire(message.eye_from_world);
  if (!eye_from_world)
    return messages::BadMessage{"bad_tile", "", "pose is not finite or not a rotation"};
  if (const auto why = messages::why_implausible(message.frame, message.capture_stamp_ns))
    return messages::BadMessage{"bad_tile", "", *why};
  ReceivedTile tile;
  tile.frame = message.frame;
  tile.capture_stamp_ns = message.capture_stamp_ns;
  tile.tile = message.tile;
  tile.tiles = message.tiles;
  tile.eye_from_world = *eye_from_world;
  tile.recon = messages::from_wire(message.recon);
  tile.rect = messages::from_wire(message.rect);
  tile.covered = messages::from_wire(message.covered);
  tile.depth_m = messages::span_of(message.depth_m);
  tile.bgr = messages::span_of(message.bgr);
  const auto empty_cameras = messages::span_of(message.empty_cameras);
  if (empty_cameras.size() > rig.cameras.size())
    return messages::BadMessage{"bad_tile", "", "more empty cameras than cameras"};
  for (const auto& camera : empty_cameras) {
    if (!messages::camera_index(rig, camera))
      return messages::BadMessage{"bad_tile", camera, "unknown empty camera"};
    tile.empty_cameras.emplace_back(camera);
  }
  return tile;
}

messages::Received<Highlight> highlight_from(const fivepipe_v1_CollisionResult& message) {
  if (const auto why = messages::why_implausible(message.frame, message.capture_stamp_ns))
    return messages::BadMessage{"bad_collision", message.object, *why};
  return Highlight{message.frame, message.capture_stamp_ns,
                   message.verdict == fivepipe_v1_colliding ||
                       !messages::span_of(message.first_contact).empty()};
}

messages::Received<ReceivedParticles> particles_from(const fivepipe_v1_Particles& message,
                                                     const config::Scene& scene) {
  if (const auto why = messages::why_implausible(message.frame, message.capture_stamp_ns))
    return messages::BadMessage{"bad_particles", message.source, *why};
  const auto source =
      std::find_if(scene.particles.begin(), scene.particles.end(),
                   [&](const config::ParticleSource& of) { return of.name == message.source; });
  if (source == scene.particles.end())
    return messages::BadMessage{"bad_particles", message.source, "not in the scene"};
  const auto p_m = messages::span_of(message.p_m);
  return ReceivedParticles{
      message.frame,
      message.capture_stamp_ns,
      {std::size_t(source - scene.particles.begin()), {p_m.begin(), p_m.end()}}};
}

messages::Received<std::vector<ObjectPose>> poses_from(const fivepipe_v1_VirtualState& message,
                                                       const config::Scene& scene) {
  if (const auto why = messages::why_implausible(message.frame, message.capture_stamp_ns))
    return messages::BadMessage{"bad_state", "", *why};
  const auto objects = messages::span_of(message.objects);
  if (objects.size() > scene.objects.size())
    return messages::BadMessage{"bad_state", "", "more objects than the scene has"};
  std::vector<ObjectPose> poses;
  for (const fivepipe_v1_ObjectState& object : objects) {
    const auto pose = messages::from_wire(object.world_from_object);
    if (!pose)
      return messages::BadMessage{"bad_state", object.object,
                                  "pose is not finite or not a rotation"};
    const auto vertices = messages::span_of(object.vertices_m),
               warmth = messages::span_of(object.warmth);
    poses.push_back(
        {object.object, *pose, {vertices.begin(), vertices.end()}, {warmth.begin(), warmth.end()}});
  }
  return poses;
}

fivepipe_v1_FrameComposited composited_message(const std::string& viewer, const HullFrame& hull,
                                               std::int64_t composited_stamp_ns) {
  fivepipe_v1_FrameComposited message{};
  messages::set_text(message.viewer, viewer);
  message.frame = hull.frame;
  message.capture_stamp_ns = hull.capture_stamp_ns;
  message.composited_stamp_ns = composited_stamp_ns;
  return message;
}

}  // namespace fivepipe::render
