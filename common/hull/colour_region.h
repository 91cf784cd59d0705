// The pixels of a camera's colour image that can show real objects.
#pragma once
#include <cstdint>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

struct ColourRegion {
  geometry::Camera camera;  // published pinhole, pose at the exposure
  ObjectPixels pixels;      // whose colours are here; of the image's size
  PixelRect region;         // inside the image; holds them
  std::vector<std::uint8_t>
      bgr;  // 3 bytes a pixel of `region`, row-major; of those that are not in `pixels`, anything
};

}  // namespace fivepipe::hull
