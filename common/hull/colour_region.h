// The pixels of a camera's colour image that can show real objects.
#pragma once
#include <cstdint>
#include <vector>

#include "common/geometry/camera.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

struct ColourRegion {
  geometry::Camera camera;  // published pinhole, pose at the exposure
  ObjectPixels pixels;      // the pixels with a valid colour; has the image's size
  PixelRect region;         // inside the image; holds all of `pixels`
  // 3 bytes per pixel of `region`, row-major. Unspecified for pixels that are not in `pixels`.
  std::vector<std::uint8_t> bgr;
};

}  // namespace fivepipe::hull
