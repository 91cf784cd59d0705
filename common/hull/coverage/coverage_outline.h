// The coverage of the pixels at an outline. With the object pixels, it gives the coverage of the
// whole image.
#pragma once
#include <cstdint>
#include <vector>

#include "common/hull/object_pixels.h"

namespace fivepipe::hull {

// All other object pixels are covered wholly (255), and all other pixels not at all (0).
struct CoverageOutline {
  ObjectPixels pixels;                 // has the image's size
  std::vector<std::uint8_t> coverage;  // one byte per pixel of `pixels`, row by row
  bool operator==(const CoverageOutline&) const = default;
};

}  // namespace fivepipe::hull
