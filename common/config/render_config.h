// Settings of the rendering node.
#pragma once
#include <cstdint>

namespace fivepipe::config {

struct RenderConfig {
  bool window = false;  // also shows a window (needs a display)
  bool video = true;    // writes composite.mp4 to the output folder
  // Frame of composite.png: the first composited frame at or after this one.
  std::int64_t still_frame = 0;
};

}  // namespace fivepipe::config
