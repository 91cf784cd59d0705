// Connected components of packed object pixels: hysteresis, and removal of specks and holes by
// their area. Works on runs of pixels with union-find, one pass over the image.
#pragma once
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

// Returns the components (of 8 neighbours) that have at least min_area_px pixels, and at least one
// pixel of `seeds`, which must have the same size.
hull::ObjectPixels seeded_components(const hull::ObjectPixels& pixels,
                                     const hull::ObjectPixels& seeds, int min_area_px);

// Fills the holes of at most max_area_px pixels: components (of 4 neighbours) of the other pixels
// that do not touch the border of the image.
hull::ObjectPixels with_holes_filled(const hull::ObjectPixels& pixels, int max_area_px);

}  // namespace fivepipe::capture
