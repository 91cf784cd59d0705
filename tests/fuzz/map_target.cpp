// ObjectPixelMap, ObjectColour and ObjectCoverage: decoding of their payloads, and validation.
#include <array>
#include <numbers>

#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/messages/object_pixels_codec.h"
#include "tests/fuzz/message_bytes.h"
#include "tests/fuzz/poses.h"

namespace fivepipe::fuzz {
namespace {

constexpr const char* kFile = "map.bin";
constexpr std::int64_t kStamp_ns = 1'700'000'000'000'000'000;

enum Kind : std::uint32_t { kMap, kColour, kCoverage };

struct Header {
  char camera[40];
  std::uint64_t frame;
  std::int64_t stamp_ns;
  std::int32_t width_px, height_px;
  fivepipe_v1_PixelRect region;
  std::uint32_t object_pixels, encoding, payload_bytes, kind;
  fivepipe_v1_Pose pose;
};
static_assert(sizeof(Header) == 40 + 2 * 8 + 2 * 4 + 16 + 4 * 4 + 7 * 8, "no padding");

// Widths with and without a whole number of words.
const config::Rig& rig() {
  static const config::Rig rig = [] {
    config::Rig made;
    made.name = "fuzz";
    const auto add = [&](const char* name, int width_px, int height_px, bool gives_shape) {
      config::RigCamera& camera = made.cameras.emplace_back();
      camera.name = name;
      camera.published = camera.source =
          geometry::pinhole_from_fov(width_px, height_px, 0.3 * std::numbers::pi);
      camera.gives_shape = gives_shape;
      camera.mount = gives_shape ? config::Mount::world : config::Mount::viewer;
    };
    add("left", 130, 37, true);
    add("right", 64, 9, true);
    add("one", 1, 1, true);
    add("hmd", 71, 40, false);
    return made;
  }();
  return rig;
}

hull::ObjectPixels random_pixels(Random& random, const geometry::Pinhole& image) {
  hull::ObjectPixels pixels(image.width_px, image.height_px);
  for (std::size_t runs = below(random, 40); runs > 0; --runs) {
    const int v = int(below(random, std::size_t(image.height_px))),
              u = int(below(random, std::size_t(image.width_px)));
    pixels.set_run(u, u + 1 + int(below(random, std::size_t(image.width_px - u))), v);
  }
  return pixels;
}

std::string valid_message(Random& random) {
  const config::RigCamera& camera = any_of(random, rig().cameras);
  const hull::ObjectPixels pixels = random_pixels(random, camera.published);
  Header header{};
  header.kind = !camera.gives_shape || one_in(random, 3) ? kColour
                : one_in(random, 3)                      ? kCoverage
                                                         : kMap;
  std::vector<std::uint8_t> payload, bgr;  // or the coverage
  const auto take_common = [&](const auto& message) {
    set_name(header.camera, message.camera, std::strlen(message.camera));
    header.frame = message.frame;
    header.stamp_ns = message.capture_stamp_ns;
    header.width_px = message.image_width_px;
    header.height_px = message.image_height_px;
    header.region = message.region;
    header.encoding = std::uint32_t(message.encoding);
  };
  if (header.kind == kCoverage) {
    hull::CoverageOutline outline{pixels, {}};
    for (std::size_t i = 0; i < pixels.count(); ++i)
      outline.coverage.push_back(std::uint8_t(random()));
    auto message = messages::coverage_message(camera.name, random(), kStamp_ns, outline);
    take_common(message.header);
    payload = message.pixels;
    bgr = message.coverage;
  } else if (header.kind == kColour) {
    const hull::PixelRect region = pixels.bounds();
    std::vector<std::uint8_t> image(3 * region.area_px());
    for (std::uint8_t& value : image) value = std::uint8_t(random());
    const hull::ColourRegion colour{config::published_camera(camera), pixels, region,
                                    std::move(image)};
    auto message = messages::colour_message(camera.name, random(), kStamp_ns, colour);
    take_common(message.header);
    header.pose = message.header.camera_from_world;
    payload = message.pixels;
    bgr = message.bgr;
  } else {
    auto message = messages::map_message(camera.name, random(), kStamp_ns, pixels);
    take_common(message.header);
    header.object_pixels = message.header.object_pixels;
    payload = message.payload;
  }
  header.payload_bytes = std::uint32_t(payload.size());
  std::string bytes;
  append_object(bytes, header);
  append_elements(bytes, std::span<const std::uint8_t>(payload));
  append_elements(bytes, std::span<const std::uint8_t>(bgr));
  return bytes;
}

std::vector<File> input(Random& random) {
  std::string bytes = valid_message(random);
  for (std::size_t mutations = below(random, 4); mutations > 0; --mutations) {
    if (one_in(random, 2) && bytes.size() > sizeof(Header)) {  // the payload alone
      std::string payload = bytes.substr(sizeof(Header));
      mutate_bytes(random, payload);
      bytes.replace(sizeof(Header), std::string::npos, payload);
    } else if (one_in(random, 4)) {
      mutate_bytes(random, bytes);
    } else {
      mutate_field(random, bytes, 0, sizeof(Header));
    }
  }
  return {{kFile, std::move(bytes)}};
}

std::string broken_pixels(const hull::ObjectPixels& pixels, const fivepipe_v1_PixelRect& wire,
                          fivepipe_v1_MapEncoding encoding,
                          const std::vector<std::uint8_t>& payload,
                          const geometry::Pinhole& image) {
  if (pixels.width_px() != image.width_px || pixels.height_px() != image.height_px)
    return "the map has another size than the image";
  hull::ObjectPixels rebuilt(image.width_px, image.height_px);
  for (int v = 0; v < image.height_px; ++v)
    for (int u = 0; u < image.width_px; ++u)
      if (pixels.contains(u, v)) rebuilt.set(u, v);
  if (!(rebuilt == pixels)) return "bits beyond the width are set";
  const hull::PixelRect region = messages::from_wire(wire);
  if (!(hull::intersection(pixels.bounds(), region) == pixels.bounds()) && pixels.count() > 0)
    return "object pixels outside the region";
  const auto again = encoding == fivepipe_v1_packed_bits ? messages::packed_bits(pixels, region)
                                                         : messages::run_lengths(pixels, region);
  if (again != payload) return "the decoder accepts a payload that no encoder writes";
  return "";
}

// Sets the fields that all three messages have.
template <class Message>
void set_common(Message& message, const Header& header) {
  set_name(message.camera, header.camera, sizeof header.camera);
  message.frame = header.frame;
  message.capture_stamp_ns = header.stamp_ns;
  message.image_width_px = header.width_px;
  message.image_height_px = header.height_px;
  message.region = header.region;
  message.encoding = fivepipe_v1_MapEncoding(header.encoding % 2);  // Cyclone DDS checks it
}

Verdict check_map(const Header& header, std::vector<std::uint8_t> payload) {
  fivepipe_v1_ObjectPixelMap message{};
  set_common(message, header);
  message.object_pixels = header.object_pixels;
  messages::borrow(message.payload, payload);
  const auto received = messages::object_pixels_from(message, rig());
  const auto* map = std::get_if<frames::CameraMap>(&received);
  if (map == nullptr) return {};
  const config::RigCamera& camera = rig().cameras.at(map->camera);
  if (!camera.gives_shape) return {true, "a map of a camera that gives no shape"};
  if (messages::why_implausible(map->frame, map->capture_stamp_ns))
    return {true, "an implausible frame or stamp"};
  if (map->pixels.count() != message.object_pixels) return {true, "the count differs"};
  if (std::string broken =
          broken_pixels(map->pixels, message.region, message.encoding, payload, camera.published);
      !broken.empty())
    return {true, broken};
  auto again = messages::map_message(camera.name, map->frame, map->capture_stamp_ns, map->pixels);
  const auto decoded = messages::object_pixels_from(again.message(), rig());
  const auto* same = std::get_if<frames::CameraMap>(&decoded);
  if (same == nullptr || !(same->pixels == map->pixels)) return {true, "decode(encode(x)) != x"};
  return {true, ""};
}

// Returns the colours of the set pixels, row by row.
std::vector<std::uint8_t> colours_of(const hull::ColourRegion& colour) {
  std::vector<std::uint8_t> bgr;
  colour.pixels.for_each_run(colour.pixels.bounds(), [&](int v, int begin, int end) {
    for (int u = begin; u < end; ++u)
      for (int c = 0; c < 3; ++c)
        bgr.push_back(colour.bgr.at(
            3 * (std::size_t(v - colour.region.v0_px) * std::size_t(colour.region.width_px()) +
                 std::size_t(u - colour.region.u0_px)) +
            std::size_t(c)));
  });
  return bgr;
}

Verdict check_colour(const Header& header, std::vector<std::uint8_t> payload,
                     std::vector<std::uint8_t> bgr) {
  fivepipe_v1_ObjectColour message{};
  set_common(message, header);
  message.camera_from_world = header.pose;
  messages::borrow(message.pixels, payload);
  messages::borrow(message.bgr, bgr);
  const auto received = messages::colour_from(message, rig());
  const auto* colour = std::get_if<messages::CameraColour>(&received);
  if (colour == nullptr) return {};
  const config::RigCamera& camera = rig().cameras.at(colour->camera);
  if (!is_rigid(colour->colour.camera.camera_from_world)) return {true, "the pose is not rigid"};
  if (std::string broken = broken_pixels(colour->colour.pixels, message.region, message.encoding,
                                         payload, camera.published);
      !broken.empty())
    return {true, broken};
  if (colours_of(colour->colour) != bgr) return {true, "the colours differ"};
  auto again = messages::colour_message(camera.name, colour->frame, colour->capture_stamp_ns,
                                        colour->colour);
  const auto decoded = messages::colour_from(again.message(), rig());
  const auto* same = std::get_if<messages::CameraColour>(&decoded);
  if (same == nullptr || !(same->colour.pixels == colour->colour.pixels) ||
      colours_of(same->colour) != bgr)
    return {true, "decode(encode(x)) != x"};
  return {true, ""};
}

Verdict check_coverage(const Header& header, std::vector<std::uint8_t> payload,
                       std::vector<std::uint8_t> coverage) {
  fivepipe_v1_ObjectCoverage message{};
  set_common(message, header);
  messages::borrow(message.pixels, payload);
  messages::borrow(message.coverage, coverage);
  const auto received = messages::coverage_from(message, rig());
  const auto* of = std::get_if<messages::CameraCoverage>(&received);
  if (of == nullptr) return {};
  const config::RigCamera& camera = rig().cameras.at(of->camera);
  if (!camera.gives_shape) return {true, "coverage of a camera that gives no shape"};
  if (messages::why_implausible(of->frame, of->capture_stamp_ns))
    return {true, "an implausible frame or stamp"};
  if (std::string broken = broken_pixels(of->outline.pixels, message.region, message.encoding,
                                         payload, camera.published);
      !broken.empty())
    return {true, broken};
  if (of->outline.coverage != coverage || coverage.size() != of->outline.pixels.count())
    return {true, "the coverage differs"};
  auto again =
      messages::coverage_message(camera.name, of->frame, of->capture_stamp_ns, of->outline);
  const auto decoded = messages::coverage_from(again.message(), rig());
  const auto* same = std::get_if<messages::CameraCoverage>(&decoded);
  if (same == nullptr || !(same->outline == of->outline)) return {true, "decode(encode(x)) != x"};
  return {true, ""};
}

Verdict check(const std::filesystem::path& folder) {
  const std::string bytes = bytes_of_file(folder / kFile);
  std::string_view rest = bytes;
  const auto header = take_object<Header>(rest);
  // A map has no sequence after the payload, so it takes the rest.
  const bool is_map = header.kind != kColour && header.kind != kCoverage;
  const std::size_t payload_bytes = is_map ? rest.size() : header.payload_bytes;
  auto payload = take_elements<std::uint8_t>(rest, payload_bytes);
  if (is_map) return check_map(header, std::move(payload));
  auto values = take_elements<std::uint8_t>(rest, rest.size());
  if (header.kind == kCoverage)
    return check_coverage(header, std::move(payload), std::move(values));
  return check_colour(header, std::move(payload), std::move(values));
}

}  // namespace

Target map_target() {
  return {"map",
          "messages ObjectPixelMap, ObjectColour and ObjectCoverage: decoding and validation",
          input, check};
}

}  // namespace fivepipe::fuzz
