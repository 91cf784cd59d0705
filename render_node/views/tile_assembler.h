// Assembles the tiles of one view, which the reconstruction nodes send, into whole frames.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/hull.h"
#include "common/pipeline/frames/recent_frames.h"

namespace fivepipe::render {

// One received tile. The spans refer to the message and must not outlive it.
struct ReceivedTile {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
  std::int64_t received_ns = 0;       // CLOCK_REALTIME, by this process
  std::uint32_t tile = 0, tiles = 0;  // index, and number of tiles in the view
  Eigen::Isometry3d eye_from_world = Eigen::Isometry3d::Identity();
  geometry::Pinhole recon;
  hull::PixelRect rect;     // the tile, in pixels of the reconstruction image
  hull::PixelRect covered;  // the part of `rect` that the message holds; may be empty
  // Of `covered`, row-major, along the view's z; kNoHull if the ray misses the hull.
  std::span<const float> depth_m;
  std::span<const std::uint8_t> bgr;  // of `covered`, 3 bytes per pixel; may be empty
  std::vector<std::string> empty_cameras;
};

// The hull as one view sees it. A frame without depth still holds the pose of the view.
struct HullFrame {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
  std::int64_t first_received_ns = 0, last_received_ns = 0;  // of its tiles
  Eigen::Isometry3d eye_from_world = Eigen::Isometry3d::Identity();
  geometry::Pinhole recon;
  hull::PixelRect covered;  // contains every pixel that shows the hull
  // The whole reconstruction image, row-major, along the view's z; empty if there is no hull.
  std::vector<float> depth_m;
  // The whole image, 3 bytes per pixel; empty unless every tile that shows the hull has colour.
  std::vector<std::uint8_t> bgr;
  std::vector<std::string> empty_cameras;  // cameras without an object pixel, sorted
};

// Numbers of frames and tiles by outcome since construction.
struct TileCounts {
  std::uint64_t complete = 0;    // frames
  std::uint64_t incomplete = 0;  // frames dropped for a newer one
  std::uint64_t late = 0;        // tiles of frames that are already complete or dropped
  // Tiles received twice, because a restarted node sends its frame again. The assembler keeps the
  // first one.
  std::uint64_t duplicate = 0;
  std::uint64_t restarts = 0;  // times the source restarted its frame count

  TileCounts& operator+=(const TileCounts& other);
};

// A tile that is invalid, or contradicts the other tiles of its frame.
struct RefusedTile {
  std::string reason;
};
// HullFrame: the tile completed the frame. monostate: the frame lacks tiles, or the tile is late or
// a duplicate.
using AddedTile = std::variant<std::monostate, HullFrame, RefusedTile>;

// The order of the frames that leave the assembler.
//   completion: as they complete. A complete frame drops all older open frames.
//   capture: a complete frame drops none, and the caller sorts. For lossless replays with `split:
//     frames`, where a frame may overtake an older one of another recon_node.
enum class FrameOrder { completion, capture };

// Assembles several frames at a time. If a tile of a new frame arrives while max_open_frames are
// open, the one that was opened first is dropped.
class TileAssembler {
 public:
  // As many frames as a reader holds of a tile (bus.cpp): a busy node takes them all at once.
  static constexpr std::size_t kMaxOpenFrames = 8;
  // A message with more tiles is invalid: no view needs as many.
  static constexpr std::uint32_t kMaxTiles = 4096;
  // If the tiles of this many frames in a row are older than the last complete frame, that frame's
  // number counts as wrong, for example that of a peer, and the assembler resets. A reader
  // holds 8 samples per tile (bus.cpp), so a busy node takes the tiles of at most 8 late frames in
  // a row.
  static constexpr std::uint32_t kMaxLateFrames = 16;

  // Accepts only tiles of the view `recon` with depths in [near_m, far_m].
  TileAssembler(const geometry::Pinhole& recon, double near_m, double far_m,
                std::size_t max_open_frames = kMaxOpenFrames);

  AddedTile add(const ReceivedTile& tile, FrameOrder order = FrameOrder::completion);

  // Drops the open frames and accepts any frame number next. Call when a replay starts.
  void reset();

  const TileCounts& counts() const { return counts_; }
  std::size_t open_frames() const { return open_.size(); }

 private:
  struct OpenFrame {
    HullFrame hull;
    std::vector<hull::PixelRect> rects;  // by tile; empty if the tile has not arrived
    std::size_t tiles_here = 0, area_px = 0;
    bool all_coloured = true;
  };

  struct FrameStamp {
    std::uint64_t frame;
    std::int64_t capture_stamp_ns;
  };

  std::optional<std::string> why_refused(const ReceivedTile& tile) const;
  std::optional<std::string> why_inconsistent(const ReceivedTile& tile,
                                              const OpenFrame& open) const;
  bool is_late(const ReceivedTile& tile, FrameOrder order);
  void restart();
  OpenFrame& open_for(const ReceivedTile& tile);
  HullFrame completed(std::uint64_t frame, FrameOrder order);

  geometry::Pinhole recon_;
  float near_m_, far_m_;
  frames::RecentFrames<OpenFrame> open_;
  std::optional<FrameStamp> last_complete_;
  std::uint32_t late_in_a_row_ = 0;
  TileCounts counts_;
};

}  // namespace fivepipe::render
