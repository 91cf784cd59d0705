#include "common/recording/replay/recorded_messages.h"

#include "common/recording/schema/cdr_cursor.h"

namespace fivepipe::replay {
namespace {

using messages::BadMessage;

template <std::size_t N>
void take_name(schema::CdrCursor& cursor, char (&name)[N]) {
  messages::set_text(name, std::string(cursor.take_string(N - 1)));
}

template <class Message>
void take_frame(schema::CdrCursor& cursor, Message& message) {
  message.frame = cursor.take<std::uint64_t>();
  message.capture_stamp_ns = cursor.take<std::int64_t>();
}

void take(schema::CdrCursor& cursor, fivepipe_v1_PixelRect& rect) {
  for (std::int32_t* value : {&rect.u0_px, &rect.v0_px, &rect.u1_px, &rect.v1_px})
    *value = cursor.take<std::int32_t>();
}

void take(schema::CdrCursor& cursor, fivepipe_v1_Pose& pose) {
  for (double* value : {&pose.translation_m.x, &pose.translation_m.y, &pose.translation_m.z,
                        &pose.rotation.x, &pose.rotation.y, &pose.rotation.z, &pose.rotation.w})
    *value = cursor.take<double>();
}

// Borrows the payload.
template <class Octets>
void take_octets(schema::CdrCursor& cursor, Octets& octets) {
  const std::uint32_t bytes = cursor.take_count(0);
  octets._buffer = const_cast<std::uint8_t*>(
      reinterpret_cast<const std::uint8_t*>(cursor.take_bytes(bytes).data()));
  octets._length = octets._maximum = bytes;
}

fivepipe_v1_MapEncoding take_encoding(schema::CdrCursor& cursor) {
  return fivepipe_v1_MapEncoding(cursor.take<std::uint32_t>());
}

}  // namespace

messages::Received<frames::CameraMap> map_from(std::span<const std::byte> cdr,
                                               const config::Rig& rig) try {
  schema::CdrCursor cursor(cdr);
  fivepipe_v1_ObjectPixelMap map{};
  take_name(cursor, map.camera);
  take_frame(cursor, map);
  map.image_width_px = cursor.take<std::int32_t>();
  map.image_height_px = cursor.take<std::int32_t>();
  take(cursor, map.region);
  map.object_pixels = cursor.take<std::uint32_t>();
  map.encoding = take_encoding(cursor);
  take_octets(cursor, map.payload);
  return messages::object_pixels_from(map, rig);
} catch (const schema::CdrFault& fault) {
  return BadMessage{"bad_map", "", fault.what};
}

messages::Received<messages::CameraColour> colour_from(std::span<const std::byte> cdr,
                                                       const config::Rig& rig) try {
  schema::CdrCursor cursor(cdr);
  fivepipe_v1_ObjectColour colour{};
  take_name(cursor, colour.camera);
  take_frame(cursor, colour);
  colour.image_width_px = cursor.take<std::int32_t>();
  colour.image_height_px = cursor.take<std::int32_t>();
  take(cursor, colour.camera_from_world);
  take(cursor, colour.region);
  colour.encoding = take_encoding(cursor);
  take_octets(cursor, colour.pixels);
  take_octets(cursor, colour.bgr);
  return messages::colour_from(colour, rig);
} catch (const schema::CdrFault& fault) {
  return BadMessage{"bad_colour", "", fault.what};
}

messages::Received<RecordedPose> head_pose_from(std::span<const std::byte> cdr) try {
  schema::CdrCursor cursor(cdr);
  fivepipe_v1_HeadPose pose{};
  take_name(cursor, pose.viewer);
  take_frame(cursor, pose);
  take(cursor, pose.eye_from_world);
  take_octets(cursor, pose.tile_owners);
  auto received = messages::head_pose_from(pose);
  if (auto* const bad = std::get_if<BadMessage>(&received)) return std::move(*bad);
  return RecordedPose{pose.viewer, std::get<messages::FramePose>(std::move(received))};
} catch (const schema::CdrFault& fault) {
  return BadMessage{"bad_head_pose", "", fault.what};
}

}  // namespace fivepipe::replay
