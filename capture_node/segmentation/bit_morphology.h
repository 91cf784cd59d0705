// Morphology on packed object pixels, 64 pixels an operation.
#pragma once
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

// radius_px times a 3x3 square; radius_px <= 0 changes nothing. Outside the image counts as set
// when eroding and as not set when dilating, so that an object cut by the image border keeps its
// pixels there.
hull::ObjectPixels eroded(hull::ObjectPixels pixels, int radius_px);
hull::ObjectPixels dilated(hull::ObjectPixels pixels, int radius_px);
hull::ObjectPixels opened(hull::ObjectPixels pixels,
                          int radius_px);  // erosion, then dilation: removes specks
hull::ObjectPixels closed(hull::ObjectPixels pixels,
                          int radius_px);  // dilation, then erosion: fills holes

}  // namespace fivepipe::capture
