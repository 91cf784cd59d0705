// Converts and validates CameraInfo, ObjectPixelMap, ObjectCoverage and ObjectColour. capture_node
// writes them; recon_node and sim_node read them.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/config/rig.h"
#include "common/hull/colour_region.h"
#include "common/hull/coverage/coverage_outline.h"
#include "common/pipeline/frames/frame_set_assembler.h"
#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::messages {

// Returns the index into rig.cameras of the camera with this name, or nullopt.
std::optional<std::size_t> camera_index(const config::Rig& rig, const char* name);

// A message with the storage of its sequences. message() points the sequences to the storage, so
// that the struct can be moved. The returned reference is valid until the move.
struct OutgoingMap {
  fivepipe_v1_ObjectPixelMap header{};
  std::vector<std::uint8_t> payload;
  const fivepipe_v1_ObjectPixelMap& message() {
    borrow(header.payload, payload);
    return header;
  }
};
// Encodes the map by the shorter of the two encodings.
OutgoingMap map_message(const std::string& camera, std::uint64_t frame,
                        std::int64_t capture_stamp_ns, const hull::ObjectPixels& pixels);

// Returns BadMessage if the camera is unknown or gives no shape, why_implausible() rejects the
// frame number or the capture stamp, the image size differs from the rig's, the region is outside
// the image, the payload is truncated, too long or undecodable, or the number of object pixels
// differs from the stated one.
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
  std::size_t camera;  // index into rig.cameras
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  hull::ColourRegion colour;
};
// Returns BadMessage as for maps, and if the number of colours differs from the number of pixels or
// the pose is not finite or not that of this rig.
Received<CameraColour> colour_from(const fivepipe_v1_ObjectColour& message, const config::Rig& rig);

struct OutgoingCoverage {
  fivepipe_v1_ObjectCoverage header{};
  std::vector<std::uint8_t> pixels, coverage;
  const fivepipe_v1_ObjectCoverage& message() {
    borrow(header.pixels, pixels);
    borrow(header.coverage, coverage);
    return header;
  }
};
OutgoingCoverage coverage_message(const std::string& camera, std::uint64_t frame,
                                  std::int64_t capture_stamp_ns,
                                  const hull::CoverageOutline& outline);

struct CameraCoverage {
  std::size_t camera;  // index into rig.cameras
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  hull::CoverageOutline outline;
};
// Returns BadMessage as for maps, and if the number of coverages differs from that of pixels.
Received<CameraCoverage> coverage_from(const fivepipe_v1_ObjectCoverage& message,
                                       const config::Rig& rig);

fivepipe_v1_CameraInfo camera_info_message(const config::RigCamera& camera);
// Describes how the published camera model differs from the rig that this node has loaded. Returns
// an empty text if they agree.
std::string model_mismatch(const fivepipe_v1_CameraInfo& info, const config::Rig& rig);

}  // namespace fivepipe::messages
