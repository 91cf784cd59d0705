// The part of a camera's colour image that holds real objects.
#pragma once
#include <cstdint>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe {

struct ColourRegion {
  Camera camera;                  // published pinhole, pose at the exposure
  PixelRect region;               // inside the image
  std::vector<std::uint8_t> bgr;  // 3 bytes a pixel of `region`, row-major
};

}  // namespace fivepipe
