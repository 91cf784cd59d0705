// CameraInfo, ObjectPixelMap and ObjectColour: wire <-> pure, validating. Used by capture_node
// (out), recon_node and sim_node (in).
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/config/rig.h"
#include "common/hull/colour_region.h"
#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::messages {

// A message with the storage that its sequences refer to. Moves; the message is borrowed from the
// storage on access.
struct OutgoingMap {
  fivepipe_v1_ObjectPixelMap header{};
  std::vector<std::uint8_t> payload;
  const fivepipe_v1_ObjectPixelMap& message() {
    borrow(header.payload, payload);
    return header;
  }
};
// The shorter of the two encodings.
OutgoingMap map_message(const std::string& camera, std::uint64_t frame,
                        std::int64_t capture_stamp_ns, const hull::ObjectPixels& pixels);

// Bad: camera unknown or giving no shape, image size not the rig's, region outside the image,
// payload truncated, too long or undecodable, count of object pixels not as stated.
Received<frames::CameraMap> object_pixels_from(const fivepipe_v1_ObjectPixelMap& message,
                                               const config::Rig& rig);

struct OutgoingColour {
  fivepipe_v1_ObjectColour header{};
  std::vector<std::uint8_t> pixels, bgr;
  const fivepipe_v1_ObjectColour& message() {
    borrow(header.pixels, pixels);
    borrow(header.bgr, bgr);
    return header;
  }
};
OutgoingColour colour_message(const std::string& camera, std::uint64_t frame,
                              std::int64_t capture_stamp_ns, const hull::ColourRegion& colour);

struct CameraColour {
  std::size_t camera;
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  hull::ColourRegion colour;
};
// Bad: as for maps, colours for more or fewer pixels than stated, or a pose that is not finite or
// not that of this rig.
Received<CameraColour> colour_from(const fivepipe_v1_ObjectColour& message, const config::Rig& rig);

fivepipe_v1_CameraInfo camera_info_message(const config::RigCamera& camera);
// What of the published model differs from the rig that this node has loaded; empty where nothing
// does.
std::string model_mismatch(const fivepipe_v1_CameraInfo& info, const config::Rig& rig);

}  // namespace fivepipe::messages
