// Assembles the views of the hull, and joins the eyes of each frame.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/config/views.h"
#include "common/pipeline/frames/recent_frames.h"
#include "render_node/views/tile_assembler.h"

namespace fivepipe::render {

// The hull of one frame as each eye of the viewer sees it, left before right; at least one.
using EyeFrames = std::vector<HullFrame>;

struct ViewCounts : TileCounts {
  std::uint64_t missing_eye = 0;  // frames dropped although one eye's view was complete
};

// EyeFrames: the tile completed the last eye of the frame. monostate: the frame lacks tiles of an
// eye, the tile is late or a duplicate, or it is of a light.
using AddedToView = std::variant<std::monostate, EyeFrames, RefusedTile>;

class ViewAssembler {
 public:
  // The views are config::hull_views().
  explicit ViewAssembler(const std::vector<config::HullView>& views);

  // Returns the number of the view with this name, or nullopt.
  std::optional<std::size_t> find(const std::string& name) const;
  // Adds a tile of the view with this number. An eye's frame waits for the other eye until
  // TileAssembler::kMaxOpenFrames further ones wait or, with FrameOrder::completion, until a newer
  // frame is complete; then it is dropped.
  AddedToView add(std::size_t view, const ReceivedTile& tile,
                  FrameOrder order = FrameOrder::completion);

  // Returns the hull in the light's view of the same frame, or null. Valid until the next add().
  const HullFrame* light_of(const HullFrame& eye) const;
  // Returns true if there is a light whose view of the frame is not complete.
  bool lacks_light_of(const HullFrame& eye) const;

  // Drops all frames and accepts any frame number next. Call when a replay starts.
  void reset();
  // Returns the sums over all views.
  ViewCounts counts() const;

 private:
  struct View {
    config::HullView of;
    TileAssembler tiles;
    // The complete frames: of a light, or of an eye that waits for the other one.
    frames::RecentFrames<HullFrame> complete{TileAssembler::kMaxOpenFrames};
  };
  AddedToView joined(const HullFrame& frame, FrameOrder order);

  std::vector<View> views_;
  std::uint64_t missing_eye_ = 0;
};

}  // namespace fivepipe::render
