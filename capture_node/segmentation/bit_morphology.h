// Morphology on packed object pixels, 64 pixels per operation.
#pragma once
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

// The structuring element is a square of 2 * radius_px + 1 pixels; radius_px <= 0 changes nothing.
// Pixels outside the image count as set for erosion and as unset for dilation, so that an object
// cut by the image border keeps its pixels there.
hull::ObjectPixels eroded(hull::ObjectPixels pixels, int radius_px);
hull::ObjectPixels dilated(hull::ObjectPixels pixels, int radius_px);
// Erosion, then dilation: removes specks.
hull::ObjectPixels opened(hull::ObjectPixels pixels, int radius_px);
// Dilation, then erosion: fills holes.
hull::ObjectPixels closed(hull::ObjectPixels pixels, int radius_px);

// Returns the pixels with at least `count` (1 to 9) set pixels in their 3x3 neighbourhood, which
// includes the pixel. Pixels outside the image count as unset.
hull::ObjectPixels with_neighbours(const hull::ObjectPixels& pixels, int count);

}  // namespace fivepipe::capture
