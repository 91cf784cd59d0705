// Keeps what is thinner than a pixel in a coverage map whose border is at one half.
//
// A strip of width w < 1 px centred on a row covers w of its pixels, and interpolated it is as wide
// as 2 - 1 / w: nothing below one half. A strip is therefore raised to the width that it has. On
// the profile across it, of pixels (above, here, below) with both neighbours below one half, the
// strip's width is s = above + here + below, for it lies in these three; with here' = 1/2 + e,
// above = 1/2 - a, below = 1/2 - b the interpolated profile is at or above one half over e / (e +
// a) + e / (e + b), so
//
//     (2 - s) e^2 + (1 - s) (a + b) e - s a b = 0        keeps the width; centred, a = b = 1/2,
//     here' = 1/2 / (1 - s / 2).
//
// Across is the direction, along rows or columns, in which the 3 x 3 neighbourhood spreads least;
// there the pixel must be the largest of three (the first of equals). Near 45 degrees one pixel may
// say rows, the next columns, and both find the larger beside them: a pixel that is the largest
// along the other direction is raised too where what is kept around it does not hang together
// without it. Where the neighbourhood holds more than 1.5 px of width there is nothing thin, but a
// gap between two things, which stays. A dot, with nothing before and behind it along the other
// direction, is raised to sqrt(area) both ways. Where a strip changes from one row to the next, its
// pixels meet at a corner, and the interpolant's saddle between them is below one half unless e1 e2
// >= a b (a, b: of the other two pixels): the larger of the other two is raised until it is not.
//
// What is left of a strip raised to its own width: from one row's coverage nobody can tell where in
// the row a strip lies, and samples a pixel apart can't hold both its borders between the same two
// rows. It is moved by up to (1 - w) / 2 px to the row that holds more of it. Two cameras still see
// such a wire in one place, three seldom do: their hull of a wire has gaps. Hence the rule
// `contained`: the row that holds more of the strip becomes 1, which spans [-1/2, 1/2], and a
// neighbour of coverage c becomes 2 c / (1 + 2 c), at which the profile reaches as far as the
// strip, to 1/2 + c. A thin strip at 45 degrees, d px beside the diagonal of two such pixels,
// leaves the share d of its coverage to the pixel between them, which must have 2 d^2 / (1 + d)^2
// for the strip's axis to be inside half way between the two; the larger of the two values is
// taken, and for all four neighbours. The axis of a straight wire is within wherever it lies, at
// the price of its width: about a pixel.
#pragma once
#include "common/hull/silhouette/coverage.h"

namespace fivepipe::hull {

// contained: what is kept holds the thin thing, and is a pixel wide or a little more.
// as_wide: it has the width of the thin thing, but may lie up to half a pixel beside it; for one or
// two cameras.
enum class ThinRule { contained, as_wide };

struct PreserveThin {
  ThinRule rule = ThinRule::contained;
  // Thinner than this is taken for noise [px], dots of less area [px^2] too; > 0. Noise of 2
  // percent of the contrast in a pixel is 3.5 percent in a sum of three; this is four times that.
  double min_width_px = 0.15;
};

// Nothing is ever lowered.
CoverageMap preserve_thin(const CoverageMap& map, const PreserveThin& keep = {});

}  // namespace fivepipe::hull
