// Collects the reconstruction's tiles of one view into whole frames.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/hull.h"

namespace fivepipe::render {

// One tile as it arrived; the spans live as long as the message does.
struct ReceivedTile {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
  std::int64_t received_ns = 0;       // CLOCK_REALTIME, by this process
  std::uint32_t tile = 0, tiles = 0;  // index, and how many make the view
  Eigen::Isometry3d eye_from_world = Eigen::Isometry3d::Identity();
  geometry::Pinhole recon;
  hull::PixelRect rect;     // the tile, in pixels of the reconstruction's image
  hull::PixelRect covered;  // inside it, all that is sent; may be empty
  std::span<const float>
      depth_m;  // of `covered`, row-major, along the view's z; kNoHull where the ray misses
  std::span<const std::uint8_t> bgr;  // of `covered`, 3 bytes a pixel; may be empty
  std::vector<std::string> empty_cameras;
};

// The hull as one view sees it. Without depth (no hull known) it still says from where the view is
// drawn.
struct HullFrame {
  std::uint64_t frame = 0;
  std::int64_t capture_stamp_ns = 0;
  std::int64_t first_received_ns = 0, last_received_ns = 0;  // of its tiles
  Eigen::Isometry3d eye_from_world = Eigen::Isometry3d::Identity();
  geometry::Pinhole recon;
  hull::PixelRect covered;     // holds every hit; nothing outside it is hull
  std::vector<float> depth_m;  // recon's whole image, row-major; empty: no hull
  std::vector<std::uint8_t>
      bgr;  // the same, 3 bytes a pixel; empty unless every tile with hits has colour
  std::vector<std::string> empty_cameras;  // without one object pixel, sorted
};

// What became of the tiles and frames, since the start.
struct TileCounts {
  std::uint64_t complete = 0;    // frames
  std::uint64_t incomplete = 0;  // frames given up for a newer one
  std::uint64_t late = 0;        // tiles of frames already complete or given up
  std::uint64_t duplicate =
      0;  // tiles that came again (a restarted node sends its frame anew); the first is kept
  std::uint64_t restarts = 0;                     // the source counts its frames anew
  std::map<std::string, std::uint64_t> rejected;  // tiles by reason
};

// Frames are put together side by side, newest wins: a complete frame ends all older ones, and when
// too many are open the oldest is given up.
class TileAssembler {
 public:
  static constexpr std::size_t kMaxOpenFrames = 4;

  // The view that the tiles must be of; depths outside [near_m, far_m] are refused.
  TileAssembler(const geometry::Pinhole& recon, double near_m, double far_m,
                std::size_t max_open_frames = kMaxOpenFrames);

  // The frame that this tile completes, if it does.
  std::optional<HullFrame> add(const ReceivedTile& tile);

  // Whatever comes next is of another time: open frames are given up.
  void reset();

  const TileCounts& counts() const { return counts_; }
  const std::string& last_rejection() const { return last_rejection_; }  // for the log
  std::size_t open_frames() const { return open_.size(); }

 private:
  struct OpenFrame {
    HullFrame hull;
    std::vector<hull::PixelRect> rects;  // by tile; empty: not here yet
    std::size_t tiles_here = 0, area_px = 0;
    bool all_coloured = true;
  };

  std::optional<std::string> why_refused(const ReceivedTile& tile) const;
  std::optional<std::string> why_inconsistent(const ReceivedTile& tile,
                                              const OpenFrame& open) const;
  bool is_late(const ReceivedTile& tile);
  OpenFrame* open_for(const ReceivedTile& tile);
  std::optional<HullFrame> completed(std::uint64_t frame);
  void drop_before(std::uint64_t frame);
  void reject(const ReceivedTile& tile, const std::string& reason);

  geometry::Pinhole recon_;
  float near_m_, far_m_;
  std::size_t max_open_frames_;
  std::map<std::uint64_t, OpenFrame> open_;
  std::uint64_t first_wanted_ = 0;            // older frames are complete or given up
  std::int64_t newest_stamp_ns_ = INT64_MIN;  // of the complete and given-up frames
  std::optional<std::uint64_t> last_complete_;
  TileCounts counts_;
  std::string last_rejection_;
};

}  // namespace fivepipe::render
