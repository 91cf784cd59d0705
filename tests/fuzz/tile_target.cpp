// HullTile: conversion, validation and assembly of a stream of tiles.
#include <algorithm>
#include <cmath>

#include "render_node/messages.h"
#include "tests/fuzz/message_bytes.h"
#include "tests/fuzz/poses.h"

namespace fivepipe::fuzz {
namespace {

using render::HullFrame;

constexpr const char* kFile = "tiles.bin";
constexpr std::int64_t kStamp_ns = 1'700'000'000'000'000'000;
constexpr double kNear_m = 0.1, kFar_m = 4.0;
constexpr int kWidth_px = 32, kHeight_px = 24;
constexpr std::uint32_t kMaxEmptyCameras = 100;

struct Header {
  std::uint64_t frame;
  std::int64_t stamp_ns;
  fivepipe_v1_Pose pose;
  fivepipe_v1_Pinhole recon;
  fivepipe_v1_PixelRect rect, covered;
  std::uint32_t tile, tiles, depths, bgr_bytes, empty_cameras, unused;
  char camera[40];
};
static_assert(sizeof(Header) == 2 * 8 + 7 * 8 + 5 * 8 + 2 * 16 + 6 * 4 + 40, "no padding");

const config::Rig& rig() {
  static const config::Rig rig = [] {
    config::Rig made;
    for (const char* name : {"left", "right"}) made.cameras.emplace_back().name = name;
    return made;
  }();
  return rig;
}

const geometry::Pinhole& recon() {
  static const geometry::Pinhole pinhole = geometry::pinhole_from_fov(kWidth_px, kHeight_px, 1.0);
  return pinhole;
}

// One of 2 x 2 tiles, with hits in a part of it, or none.
std::string valid_tile(Random& random, std::uint64_t frame, std::uint32_t tile) {
  Header header{};
  header.frame = frame;
  header.stamp_ns = kStamp_ns + std::int64_t(frame % 1000) * 33'000'000;
  header.pose = messages::to_wire(geometry::look_at({0, -1, double(frame) * 1e-3}, {0, 0, 0}));
  header.recon = messages::to_wire(recon());
  header.tile = tile;
  header.tiles = 4;
  constexpr int kTileWidth_px = kWidth_px / 2, kTileHeight_px = kHeight_px / 2;
  const int u = int(tile % 2) * kTileWidth_px, v = int(tile / 2) * kTileHeight_px;
  header.rect = {u, v, u + kTileWidth_px, v + kTileHeight_px};
  std::vector<float> depth_m;
  std::vector<std::uint8_t> bgr;
  if (!one_in(random, 4)) {
    const int u0 = u + int(below(random, kTileWidth_px)), v0 = v + int(below(random, 6));
    header.covered = {u0, v0, u + kTileWidth_px, v0 + 1 + int(below(random, 6))};
    const auto pixels =
        std::size_t(header.covered.u1_px - u0) * std::size_t(header.covered.v1_px - v0);
    for (std::size_t i = 0; i < pixels; ++i)
      depth_m.push_back(one_in(random, 4) ? hull::kNoHull : 0.1f + 0.01f * float(random() % 390));
    if (!one_in(random, 4)) bgr.assign(3 * pixels, std::uint8_t(random()));
  }
  header.depths = std::uint32_t(depth_m.size());
  header.bgr_bytes = std::uint32_t(bgr.size());
  header.empty_cameras = one_in(random, 3);
  set_name(header.camera, "left", 4);
  std::string bytes;
  append_object(bytes, header);
  append_elements(bytes, std::span<const float>(depth_m));
  append_elements(bytes, std::span<const std::uint8_t>(bgr));
  return bytes;
}

std::vector<File> input(Random& random) {
  std::vector<std::string> tiles;
  const std::uint64_t first = one_in(random, 8) ? messages::kMaxFrame - 2 : below(random, 10);
  for (std::uint64_t frame = first; frame <= first + below(random, 6); ++frame)
    for (std::uint32_t tile = 0; tile < 4; ++tile) tiles.push_back(valid_tile(random, frame, tile));
  for (std::size_t mutations = below(random, 6); mutations > 0 && !tiles.empty(); --mutations) {
    const std::size_t at = below(random, tiles.size()), other = below(random, tiles.size());
    switch (below(random, 6)) {
      case 0: std::swap(tiles[at], tiles[other]); break;
      case 1: tiles.insert(tiles.begin() + std::ptrdiff_t(at), std::string(tiles[other])); break;
      case 2: tiles.erase(tiles.begin() + std::ptrdiff_t(at)); break;
      case 3: mutate_bytes(random, tiles[at]); break;
      default: mutate_field(random, tiles[at], 0, sizeof(Header)); break;
    }
  }
  std::string bytes;
  for (const std::string& tile : tiles) bytes += tile;
  return {{kFile, std::move(bytes)}};
}

std::string broken_invariant(const HullFrame& hull) {
  const auto is_depth = [](float z) {
    return z == hull::kNoHull || (z >= float(kNear_m) && z <= float(kFar_m));
  };
  if (messages::why_implausible(hull.frame, hull.capture_stamp_ns))
    return "an implausible frame or stamp";
  if (!is_rigid(hull.eye_from_world)) return "the pose is not rigid";
  if (!(hull.recon == recon())) return "another pinhole";
  const std::size_t pixels = recon().width_px * std::size_t(recon().height_px);
  if (!hull.depth_m.empty() && hull.depth_m.size() != pixels) return "another number of depths";
  if (!hull.bgr.empty() && hull.bgr.size() != 3 * pixels) return "another number of colours";
  if (!std::ranges::all_of(hull.depth_m, is_depth)) return "a depth outside near and far";
  const hull::PixelRect image{0, 0, kWidth_px, kHeight_px};
  if (!(hull::intersection(hull.covered, image) == hull.covered)) return "covered outside the view";
  for (std::size_t i = 0; i < hull.depth_m.size(); ++i) {
    const int u = int(i) % kWidth_px, v = int(i) / kWidth_px;
    if (hull.depth_m[i] != hull::kNoHull &&
        hull::intersection(hull.covered, {u, v, u + 1, v + 1}).empty())
      return "a depth outside `covered`";
  }
  if (!std::ranges::is_sorted(hull.empty_cameras)) return "empty cameras not sorted";
  return "";
}

// Reads one message from the front of `bytes` and adds it.
render::AddedTile add(std::string_view& bytes, render::TileAssembler& tiles) {
  const auto header = take_object<Header>(bytes);
  auto depth_m = take_elements<float>(bytes, header.depths);
  auto bgr = take_elements<std::uint8_t>(bytes, header.bgr_bytes);
  std::vector<char[33]> names(std::min(header.empty_cameras, kMaxEmptyCameras));
  for (auto& name : names) set_name(name, header.camera, sizeof header.camera);
  fivepipe_v1_HullTile message{};
  message.frame = header.frame;
  message.capture_stamp_ns = header.stamp_ns;
  message.tile = std::uint16_t(header.tile);
  message.tiles = std::uint16_t(header.tiles);
  message.eye_from_world = header.pose;
  message.recon = header.recon;
  message.rect = header.rect;
  message.covered = header.covered;
  messages::borrow(message.depth_m, depth_m);
  messages::borrow(message.bgr, bgr);
  messages::borrow(message.empty_cameras, names);
  const auto received = render::tile_from(message, rig());
  const auto* tile = std::get_if<render::ReceivedTile>(&received);
  return tile != nullptr ? tiles.add(*tile) : render::AddedTile{};
}

Verdict check(const std::filesystem::path& folder) {
  const std::string bytes = bytes_of_file(folder / kFile);
  render::TileAssembler tiles(recon(), kNear_m, kFar_m);
  Verdict verdict;
  std::uint64_t complete = 0;
  for (std::string_view rest = bytes; !rest.empty() && verdict.broken.empty();) {
    const render::AddedTile added = add(rest, tiles);
    if (const auto* hull = std::get_if<HullFrame>(&added)) {
      ++complete;
      verdict = {true, broken_invariant(*hull)};
    }
    if (tiles.open_frames() > render::TileAssembler::kMaxOpenFrames)
      verdict.broken = "too many open frames";
  }
  if (complete != tiles.counts().complete) verdict.broken = "the counts differ from what happened";
  return verdict;
}

}  // namespace

Target tile_target() {
  return {"tile", "messages HullTile: validation, and assembly into frames", input, check};
}

}  // namespace fivepipe::fuzz
