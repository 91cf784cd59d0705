// Keeps what is thinner than a pixel in a coverage map whose border is at one half.
//
// A strip of width w < 1 px centred on a row covers w of its pixels, and interpolated it is as wide as 2 - 1 / w: nothing below one half.
// A strip is therefore raised to the width that it has. On the profile across it, of pixels (above, here, below) with both neighbours below
// one half, the strip's width is s = above + here + below, for it lies in these three; with here' = 1/2 + e, above = 1/2 - a, below = 1/2 - b
// the interpolated profile is at or above one half over e / (e + a) + e / (e + b), so
//
//     (2 - s) e^2 + (1 - s) (a + b) e - s a b = 0        keeps the width; centred, a = b = 1/2, here' = 1/2 / (1 - s / 2).
//
// Across is the direction, along rows or columns, in which the 3 x 3 neighbourhood spreads least; there the pixel must be the largest of
// three (the first of equals). A dot, with nothing before and behind it along the other direction, is raised to sqrt(area) both ways.
// Where a strip changes from one row to the next, its pixels meet at a corner, and the interpolant's saddle between them is below one half
// unless e1 e2 >= a b (a, b: of the other two pixels): the larger of the other two is raised until it is not.
//
// What is left: samples a pixel apart can't hold both borders of a strip between the same two rows: such a strip is moved, by up to
// (1 - w) / 2 px, to the row that holds more of it, and widened there where it changes rows. Two strips less than two pixels apart have
// no profile of their own.
#pragma once
#include "common/hull/coverage.h"

namespace fivepipe {

// Thinner than this is taken for noise [px]: noise of 2 percent of the contrast in a pixel is 3.5 percent in a sum of three; this is four times that.
inline constexpr double kLeastWidth_px = 0.15;

// least_width_px > 0. Nothing is ever lowered.
CoverageMap keep_thin(const CoverageMap& map, double least_width_px = kLeastWidth_px);

}  // namespace fivepipe
