#include "common/pipeline/messages/camera_messages.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/pipeline/messages/object_pixels_codec.h"

namespace fivepipe::messages {
namespace {

// All hosts load the same rig file. A larger difference is another calibration. Unit: pixels,
// metres or matrix elements.
constexpr double kModelTolerance = 1e-6;

// Returns why the message does not fit the rig's camera; empty if it does.
template <class Message>
std::string why_mismatched(const Message& message, const config::Rig& rig,
                           std::optional<std::size_t> index) {
  if (!index) return "unknown camera";
  if (const auto why = why_implausible(message.frame, message.capture_stamp_ns)) return *why;
  const geometry::Pinhole& k = rig.cameras[*index].published;
  if (message.image_width_px != k.width_px || message.image_height_px != k.height_px)
    return "wrong image size";
  const hull::PixelRect r = from_wire(message.region);
  if (r == hull::PixelRect{}) return "";
  if (!(r.u0_px >= 0 && r.v0_px >= 0 && r.u0_px < r.u1_px && r.v0_px < r.v1_px &&
        r.u1_px <= k.width_px && r.v1_px <= k.height_px))
    return "region outside the image";
  return "";
}

// Returns the offset of a pixel's colour in the colours of a region.
std::ptrdiff_t bgr_offset(const hull::PixelRect& region, int u_px, int v_px) {
  return 3 * (std::ptrdiff_t(v_px - region.v0_px) * region.width_px() + (u_px - region.u0_px));
}

}  // namespace

std::optional<std::size_t> camera_index(const config::Rig& rig, const char* name) {
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    if (rig.cameras[i].name == name) return i;
  return std::nullopt;
}

OutgoingMap map_message(const std::string& camera, std::uint64_t frame,
                        std::int64_t capture_stamp_ns, const hull::ObjectPixels& pixels) {
  OutgoingMap out;
  set_text(out.header.camera, camera);
  out.header.frame = frame;
  out.header.capture_stamp_ns = capture_stamp_ns;
  out.header.image_width_px = pixels.width_px();
  out.header.image_height_px = pixels.height_px();
  const hull::PixelRect region = pixels.bounds();
  out.header.region = to_wire(region);
  out.header.object_pixels = std::uint32_t(pixels.count());
  EncodedPixels code = encoded(pixels, region);
  out.header.encoding = code.encoding;
  out.payload = std::move(code.payload);
  return out;
}

Received<frames::CameraMap> object_pixels_from(const fivepipe_v1_ObjectPixelMap& message,
                                               const config::Rig& rig) {
  const auto index = camera_index(rig, message.camera);
  if (std::string why = why_mismatched(message, rig, index); !why.empty())
    return BadMessage{"bad_map", message.camera, why};
  if (!rig.cameras[*index].gives_shape)
    return BadMessage{"bad_map", message.camera, "the camera gives no shape"};
  auto pixels = decoded(message.encoding, message.image_width_px, message.image_height_px,
                        from_wire(message.region), span_of(message.payload));
  if (!pixels) return BadMessage{"bad_map", message.camera, "payload truncated or undecodable"};
  if (pixels->count() != message.object_pixels)
    return BadMessage{"bad_map", message.camera, "count of object pixels differs"};
  return frames::CameraMap{*index, message.frame, message.capture_stamp_ns, std::move(*pixels)};
}

OutgoingColour colour_message(const std::string& camera, std::uint64_t frame,
                              std::int64_t capture_stamp_ns, const hull::ColourRegion& colour) {
  OutgoingColour out;
  set_text(out.header.camera, camera);
  out.header.frame = frame;
  out.header.capture_stamp_ns = capture_stamp_ns;
  out.header.image_width_px = colour.camera.pinhole.width_px;
  out.header.image_height_px = colour.camera.pinhole.height_px;
  out.header.camera_from_world = to_wire(colour.camera.camera_from_world);
  const hull::PixelRect region = colour.pixels.bounds();
  assert(region.empty() || hull::intersection(region, colour.region) == region);
  out.header.region = to_wire(region);
  EncodedPixels code = encoded(colour.pixels, region);
  out.header.encoding = code.encoding;
  out.pixels = std::move(code.payload);
  out.bgr.reserve(3 * colour.pixels.count());
  colour.pixels.for_each_run(region, [&](int v, int begin, int end) {
    const auto first = colour.bgr.begin() + bgr_offset(colour.region, begin, v);
    out.bgr.insert(out.bgr.end(), first, first + 3 * (end - begin));
  });
  return out;
}

Received<CameraColour> colour_from(const fivepipe_v1_ObjectColour& message,
                                   const config::Rig& rig) {
  const auto index = camera_index(rig, message.camera);
  if (std::string why = why_mismatched(message, rig, index); !why.empty())
    return BadMessage{"bad_colour", message.camera, why};
  const auto pose = from_wire(message.camera_from_world);
  if (!pose)
    return BadMessage{"bad_colour", message.camera, "pose is not finite or not a rotation"};
  const hull::PixelRect region = from_wire(message.region);
  auto pixels = decoded(message.encoding, message.image_width_px, message.image_height_px, region,
                        span_of(message.pixels));
  if (!pixels) return BadMessage{"bad_colour", message.camera, "pixels truncated or undecodable"};
  const auto sent = span_of(message.bgr);
  if (sent.size() != 3 * pixels->count())
    return BadMessage{"bad_colour", message.camera, "not as many colours as pixels"};
  geometry::Camera camera{rig.cameras[*index].published, *pose};
  if (rig.cameras[*index].mount == config::Mount::world) {
    // Uses the rig's pose, so that colour and maps have the same bits.
    camera = config::published_camera(rig.cameras[*index]);
    if (!((camera.camera_from_world.matrix() - pose->matrix()).cwiseAbs().maxCoeff() <=
          kModelTolerance))
      return BadMessage{"bad_colour", message.camera, "pose differs from this node's rig"};
  }
  std::vector<std::uint8_t> bgr(3 * region.area_px());
  auto next = sent.begin();
  pixels->for_each_run(region, [&](int v, int begin, int end) {
    const auto stop = next + 3 * (end - begin);
    std::copy(next, stop, bgr.begin() + bgr_offset(region, begin, v));
    next = stop;
  });
  return CameraColour{*index, message.frame, message.capture_stamp_ns,
                      hull::ColourRegion{camera, std::move(*pixels), region, std::move(bgr)}};
}

OutgoingCoverage coverage_message(const std::string& camera, std::uint64_t frame,
                                  std::int64_t capture_stamp_ns,
                                  const hull::CoverageOutline& outline) {
  OutgoingCoverage out;
  set_text(out.header.camera, camera);
  out.header.frame = frame;
  out.header.capture_stamp_ns = capture_stamp_ns;
  out.header.image_width_px = outline.pixels.width_px();
  out.header.image_height_px = outline.pixels.height_px();
  const hull::PixelRect region = outline.pixels.bounds();
  out.header.region = to_wire(region);
  EncodedPixels code = encoded(outline.pixels, region);
  out.header.encoding = code.encoding;
  out.pixels = std::move(code.payload);
  out.coverage = outline.coverage;
  return out;
}

Received<CameraCoverage> coverage_from(const fivepipe_v1_ObjectCoverage& message,
                                       const config::Rig& rig) {
  const auto index = camera_index(rig, message.camera);
  if (std::string why = why_mismatched(message, rig, index); !why.empty())
    return BadMessage{"bad_coverage", message.camera, why};
  if (!rig.cameras[*index].gives_shape)
    return BadMessage{"bad_coverage", message.camera, "the camera gives no shape"};
  auto pixels = decoded(message.encoding, message.image_width_px, message.image_height_px,
                        from_wire(message.region), span_of(message.pixels));
  if (!pixels) return BadMessage{"bad_coverage", message.camera, "pixels truncated or undecodable"};
  const auto sent = span_of(message.coverage);
  if (sent.size() != pixels->count())
    return BadMessage{"bad_coverage", message.camera, "not as many coverages as pixels"};
  return CameraCoverage{*index,
                        message.frame,
                        message.capture_stamp_ns,
                        {std::move(*pixels), {sent.begin(), sent.end()}}};
}

fivepipe_v1_CameraInfo camera_info_message(const config::RigCamera& camera) {
  fivepipe_v1_CameraInfo info{};
  set_text(info.camera, camera.name);
  info.pinhole = to_wire(camera.published);
  info.carried_by_viewer = camera.mount == config::Mount::viewer;
  info.camera_from_mount = to_wire(camera.camera_from_mount);
  return info;
}

std::string model_mismatch(const fivepipe_v1_CameraInfo& info, const config::Rig& rig) {
  const auto index = camera_index(rig, info.camera);
  if (!index) return "published, but not in the rig '" + rig.name + "'";
  const config::RigCamera& camera = rig.cameras[*index];
  const geometry::Pinhole k = from_wire(info.pinhole);
  const auto same = [](double a, double b) {
    return std::abs(a - b) <= kModelTolerance;
  };  // false for NaN
  const geometry::Pinhole& own = camera.published;
  if (k.width_px != own.width_px || k.height_px != own.height_px || !same(k.fx_px, own.fx_px) ||
      !same(k.fy_px, own.fy_px) || !same(k.cx_px, own.cx_px) || !same(k.cy_px, own.cy_px))
    return "published intrinsics differ from this node's rig";
  const auto pose = from_wire(info.camera_from_mount);
  if (info.carried_by_viewer != (camera.mount == config::Mount::viewer) || !pose ||
      !((pose->matrix() - camera.camera_from_mount.matrix()).cwiseAbs().maxCoeff() <=
        kModelTolerance))
    return "published pose differs from this node's rig";
  return "";
}

}  // namespace fivepipe::messages
