#include "render_node/views/tile_assembler.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace fivepipe::render {
namespace {

// Accepted difference of two pose elements [m, or dimensionless]. All nodes use the same HeadPose,
// but binaries of different compilers may compute its matrix differently. A micrometre is far below
// a pixel at any distance.
constexpr double kPoseTolerance = 1e-6;

// Both functions only compare: a message may hold any coordinates, and a difference may overflow.
bool is_empty(const hull::PixelRect& rect) {
  return rect.u0_px >= rect.u1_px || rect.v0_px >= rect.v1_px;
}
bool inside(const hull::PixelRect& inner, const hull::PixelRect& outer) {
  return inner.u0_px >= outer.u0_px && inner.v0_px >= outer.v0_px && inner.u1_px <= outer.u1_px &&
         inner.v1_px <= outer.v1_px;
}

// `b` is not empty.
hull::PixelRect bounding_rect(const hull::PixelRect& a, const hull::PixelRect& b) {
  if (a.empty()) return b;
  return {std::min(a.u0_px, b.u0_px), std::min(a.v0_px, b.v0_px), std::max(a.u1_px, b.u1_px),
          std::max(a.v1_px, b.v1_px)};
}

// Copies the pixels of a tile, `bytes_per_px` bytes each, into an image of width_px.
void copy_rows(const hull::PixelRect& rect, int width_px, std::size_t bytes_per_px,
               const void* from, void* to) {
  const std::size_t row_bytes = std::size_t(rect.width_px()) * bytes_per_px;
  for (int v = rect.v0_px; v < rect.v1_px; ++v)
    std::memcpy(
        static_cast<char*>(to) +
            (std::size_t(v) * std::size_t(width_px) + std::size_t(rect.u0_px)) * bytes_per_px,
        static_cast<const char*>(from) + std::size_t(v - rect.v0_px) * row_bytes, row_bytes);
}

}  // namespace

TileCounts& TileCounts::operator+=(const TileCounts& other) {
  complete += other.complete;
  incomplete += other.incomplete;
  late += other.late;
  duplicate += other.duplicate;
  restarts += other.restarts;
  return *this;
}

TileAssembler::TileAssembler(const geometry::Pinhole& recon, double near_m, double far_m,
                             std::size_t max_open_frames)
    : recon_(recon), near_m_(float(near_m)), far_m_(float(far_m)), open_(max_open_frames) {}

AddedTile TileAssembler::add(const ReceivedTile& tile, FrameOrder order) {
  if (auto reason = why_refused(tile)) return RefusedTile{std::move(*reason)};
  if (is_late(tile, order)) return {};
  OpenFrame& open = open_for(tile);
  if (auto reason = why_inconsistent(tile, open)) return RefusedTile{std::move(*reason)};
  if (!open.rects[tile.tile].empty()) {
    ++counts_.duplicate;
    return {};
  }
  open.hull.last_received_ns = tile.received_ns;
  open.rects[tile.tile] = tile.rect;
  open.area_px += tile.rect.area_px();
  ++open.tiles_here;
  if (!is_empty(tile.covered)) {
    HullFrame& hull = open.hull;
    copy_rows(tile.covered, recon_.width_px, sizeof(float), tile.depth_m.data(),
              hull.depth_m.data());
    hull.covered = bounding_rect(hull.covered, tile.covered);
    open.all_coloured &= !tile.bgr.empty();
    if (open.all_coloured) {
      hull.bgr.resize(hull.depth_m.size() * 3);
      copy_rows(tile.covered, recon_.width_px, 3, tile.bgr.data(), hull.bgr.data());
    }
  }
  open.hull.empty_cameras.insert(open.hull.empty_cameras.end(), tile.empty_cameras.begin(),
                                 tile.empty_cameras.end());
  if (open.tiles_here < open.rects.size()) return {};
  if (open.area_px != std::size_t(recon_.width_px) * std::size_t(recon_.height_px)) {
    open_.take(tile.frame);
    return RefusedTile{"tiles leave gaps in the view"};
  }
  return completed(tile.frame, order);
}

// Returns why the tile is invalid by itself, or nullopt.
std::optional<std::string> TileAssembler::why_refused(const ReceivedTile& tile) const {
  if (tile.tiles == 0 || tile.tiles > kMaxTiles || tile.tile >= tile.tiles)
    return "bad tile number";
  if (!(tile.recon == recon_)) return "pinhole of another view";
  if (geometry::why_unusable(geometry::Camera{tile.recon, tile.eye_from_world}))
    return "unusable pose";
  if (is_empty(tile.rect) || !inside(tile.rect, {0, 0, recon_.width_px, recon_.height_px}))
    return "rect outside the view";
  const bool no_hits = is_empty(tile.covered);
  if (!no_hits && !inside(tile.covered, tile.rect)) return "covered rect outside its tile";
  const std::size_t covered_px = no_hits ? 0 : tile.covered.area_px();
  if (tile.depth_m.size() != covered_px) return "wrong number of depths";
  if (!tile.bgr.empty() && tile.bgr.size() != 3 * covered_px) return "wrong number of colours";
  const auto is_depth = [&](float z) {
    return z == hull::kNoHull || (z >= near_m_ && z <= far_m_);
  };
  if (!std::all_of(tile.depth_m.begin(), tile.depth_m.end(), is_depth))
    return "depth not finite or outside near and far";
  return {};
}

// Returns why the tile contradicts the other tiles of its frame, or nullopt.
std::optional<std::string> TileAssembler::why_inconsistent(const ReceivedTile& tile,
                                                           const OpenFrame& open) const {
  if (tile.tiles != open.rects.size()) return "number of tiles differs within the frame";
  if (tile.capture_stamp_ns != open.hull.capture_stamp_ns)
    return "capture stamp differs within the frame";
  const Eigen::Matrix4d difference =
      tile.eye_from_world.matrix() - open.hull.eye_from_world.matrix();
  if (!(difference.cwiseAbs().maxCoeff() <= kPoseTolerance)) return "pose differs within the frame";
  for (std::size_t other = 0; other < open.rects.size(); ++other) {
    if (other == tile.tile && !open.rects[other].empty() && !(open.rects[other] == tile.rect))
      return "repeated tile with another rect";
    if (other != tile.tile && !hull::intersection(open.rects[other], tile.rect).empty())
      return "rect overlaps another tile";
  }
  return {};
}

void TileAssembler::reset() {
  counts_.incomplete += open_.size();
  open_.clear();
  last_complete_.reset();
}

void TileAssembler::restart() {
  ++counts_.restarts;
  reset();
}

// Returns true for a tile of a completed or dropped frame. A restarted source counts from 0 again:
// its frame number is lower, but its capture stamp is later than that of the last complete frame.
// Such a tile resets the assembler and is not late.
bool TileAssembler::is_late(const ReceivedTile& tile, FrameOrder order) {
  const bool is_newer = !last_complete_ || tile.frame > last_complete_->frame;
  if (order == FrameOrder::capture && !is_newer &&
      tile.capture_stamp_ns > last_complete_->capture_stamp_ns) {
    restart();
    return false;
  }
  if (open_.was_displaced(tile.frame)) {
    ++counts_.late;
    return true;
  }
  if (is_newer || order == FrameOrder::capture) {
    late_in_a_row_ = 0;
    return false;
  }
  if (tile.capture_stamp_ns > last_complete_->capture_stamp_ns ||
      ++late_in_a_row_ >= kMaxLateFrames * tile.tiles) {
    restart();
    return false;
  }
  ++(last_complete_->frame == tile.frame ? counts_.duplicate : counts_.late);
  return true;
}

// Returns the open frame of the tile and opens it if needed.
TileAssembler::OpenFrame& TileAssembler::open_for(const ReceivedTile& tile) {
  if (OpenFrame* const found = open_.find(tile.frame)) return *found;
  const auto& [open, displaced] = open_.get_or_add(tile.frame);
  counts_.incomplete += displaced.has_value();
  open.hull = {tile.frame,
               tile.capture_stamp_ns,
               tile.received_ns,
               tile.received_ns,
               tile.eye_from_world,
               recon_,
               {},
               {},
               {},
               {}};
  open.hull.depth_m.assign(std::size_t(recon_.width_px) * std::size_t(recon_.height_px),
                           hull::kNoHull);
  open.rects.resize(tile.tiles);
  return open;
}

HullFrame TileAssembler::completed(std::uint64_t frame, FrameOrder order) {
  const bool in_order = order == FrameOrder::capture;
  OpenFrame open = in_order ? *open_.close(frame) : *open_.take(frame);
  if (!in_order) counts_.incomplete += open_.erase_up_to(frame);
  if (!in_order || !last_complete_ || frame > last_complete_->frame)
    last_complete_ = {frame, open.hull.capture_stamp_ns};
  ++counts_.complete;
  if (!open.all_coloured) open.hull.bgr.clear();
  auto& cameras = open.hull.empty_cameras;
  std::sort(cameras.begin(), cameras.end());
  cameras.erase(std::unique(cameras.begin(), cameras.end()), cameras.end());
  return std::move(open.hull);
}

}  // namespace fivepipe::render
