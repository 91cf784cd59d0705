// Preserves parts thinner than a pixel in a coverage map whose border is at one half.
//
// A strip of width w < 1 px centred on a row gives the row's pixels the coverage w. Interpolated,
// it has the width 2 - 1 / w, and none if w < 1/2. Rule `as_wide` raises the strip to its true
// width. Let (above, here, below) be the profile across the strip, with both neighbours below one
// half. The strip is within these three pixels, so its width is s = above + here + below. With
// here' = 1/2 + e, above = 1/2 - a and below = 1/2 - b, the interpolated profile is at or above one
// half over e / (e + a) + e / (e + b). The width is kept if
//
//     (2 - s) e^2 + (1 - s) (a + b) e - s a b = 0.
//
// For a centred strip (a = b = 1/2) this is here' = 1/2 / (1 - s / 2).
//
// "Across" is the direction, along rows or columns, in which the 3 x 3 neighbourhood has the
// smaller variance. There the pixel must be the largest of three (the first of equals). Near 45
// degrees adjacent pixels may choose different directions, and both may find a larger neighbour.
// Therefore a pixel that is the largest along the other direction is raised too if the kept pixels
// around it are not connected without it. A neighbourhood with at least 1.5 px of width is a gap
// between two objects and stays as it is. A dot, with nothing before and after it along the other
// direction, is raised to sqrt(area) in both directions. If a strip changes from one row to the
// next, the pixels of the two rows meet at a corner. The interpolant's saddle between them is above
// one half only if e1 e2 > a b, with a and b of the other two pixels; the larger of these two is
// raised until the condition holds.
//
// A strip raised to its own width may be displaced by up to (1 - w) / 2 px towards the row that
// holds more of it: one row's coverage does not determine the position of a strip in the row, and
// samples one pixel apart cannot represent both its borders between the same two rows. The
// displaced images of a wire in two cameras still intersect in space, but those in three seldom do,
// so the hull of the wire has gaps. Rule `contained` avoids this: the row that holds more of the
// strip becomes 1, which spans [-1/2, 1/2], and a neighbour of coverage c becomes 2 c / (1 + 2 c),
// so that the profile extends as far as the strip, to 1/2 + c. A thin strip at 45 degrees, d px
// from the diagonal of two such pixels, leaves the fraction d of its coverage to the pixel between
// them, which needs 2 d^2 / (1 + d)^2 for the strip's axis to be inside half way between the two.
// The rule applies the larger of the two values to all four neighbours. The axis of a straight wire
// is then inside at any position of the wire, but the wire becomes about one pixel wide.
#pragma once
#include "common/hull/coverage/coverage_map.h"

namespace fivepipe::hull {

// contained: the result contains the thin part and is about one pixel wide.
// as_wide: the result has the width of the thin part, but may be displaced by up to half a pixel.
// Use it with one or two cameras only.
enum class ThinRule { contained, as_wide };

struct PreserveThin {
  ThinRule rule = ThinRule::contained;
  // Strips thinner than this [px] and dots of less area [px^2] count as noise; > 0. Noise of 2 % of
  // the contrast per pixel is 3.5 % in a sum of three pixels; this is four times that.
  double min_width_px = 0.15;
};

// Returns the map with thin parts raised. It lowers no coverage.
CoverageMap preserve_thin(const CoverageMap& map, const PreserveThin& keep = {});

}  // namespace fivepipe::hull
