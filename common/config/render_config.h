// Settings of the rendering node.
#pragma once
#include <cstdint>
#include <optional>

#include "common/config/view/viewer.h"

namespace fivepipe::config {

struct RenderConfig {
  bool window = false;  // also shows a window (needs a display)
  bool video = true;    // writes composite.mp4 to the output folder
  // Frame of composite.png: the first composited frame at or after this one.
  std::int64_t still_frame = 0;
  // Of a spectator, for whom the node draws instead of the deployment's viewer. It has the node's
  // name. No node waits for its composites, and the files are composite_NAME.*.
  std::optional<Viewer> viewer = {};
};

}  // namespace fivepipe::config
