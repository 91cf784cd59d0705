// Writes recordings of object-pixel maps without nodes and DDS, as fast as the disk takes them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/pipeline/messages/camera_messages.h"
#include "common/recording/files/recording_writer.h"
#include "common/recording/replay/recorder.h"
#include "common/recording/schema/wire_types.h"

namespace fivepipe::test {

// Plain CDR with its 4-byte header.
class CdrText {
 public:
  template <class Value>
  void put(Value value) {
    while ((bytes_.size() - 4) % sizeof value != 0) bytes_.push_back(std::byte{0});
    put_bytes(std::as_bytes(std::span(&value, 1)));
  }
  void put_string(const std::string& text) {
    put(std::uint32_t(text.size() + 1));
    put_bytes(std::as_bytes(std::span(text.c_str(), text.size() + 1)));
  }
  void put_bytes(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
};

inline std::vector<std::byte> cdr_of(const fivepipe_v1_ObjectPixelMap& map) {
  CdrText cdr;
  cdr.put_string(map.camera);
  cdr.put(std::uint64_t(map.frame));
  cdr.put(std::int64_t(map.capture_stamp_ns));
  for (const std::int32_t value : {map.image_width_px, map.image_height_px, map.region.u0_px,
                                   map.region.v0_px, map.region.u1_px, map.region.v1_px})
    cdr.put(value);
  cdr.put(std::uint32_t(map.object_pixels));
  cdr.put(std::uint32_t(map.encoding));
  cdr.put(std::uint32_t(map.payload._length));
  cdr.put_bytes(std::as_bytes(std::span(map.payload._buffer, map.payload._length)));
  return cdr.bytes();
}

// The recording is complete when this object is destroyed.
class MapRecording {
 public:
  using Topic = bus::topics::ObjectPixelMap;

  MapRecording(const std::filesystem::path& file, const config::Deployment& deployment,
               const std::map<std::string, std::string>& settings = {})
      : writer_(file, "tests", {.sync = false}) {
    replay::write_header(writer_, &deployment, settings, 0);
    for (const std::size_t i : config::shape_cameras(deployment.rig)) {
      cameras_.push_back(deployment.rig.cameras[i].name);
      channels_.push_back(writer_.add_channel(Topic::name, Topic::type,
                                              schema::fivepipe_schema(Topic::type),
                                              {{"writer", cameras_.back()}, {"node", "capture"}}));
    }
  }

  // silhouettes: of the cameras that give shape, in the rig's order.
  void add(std::uint64_t frame, std::int64_t stamp_ns,
           std::span<const hull::Silhouette> silhouettes) {
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      messages::OutgoingMap map =
          messages::map_message(cameras_[i], frame, stamp_ns, silhouettes[i].pixels);
      writer_.add(channels_[i], stamp_ns, stamp_ns, cdr_of(map.message()));
    }
    writer_.tick(stamp_ns);
  }

 private:
  recording::RecordingWriter writer_;
  std::vector<std::string> cameras_;
  std::vector<mcap::Id> channels_;
};

}  // namespace fivepipe::test
