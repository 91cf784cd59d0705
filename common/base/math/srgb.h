// The transfer curve of sRGB (IEC 61966-2-1).
#pragma once
#include <cmath>

namespace fivepipe::base {

// Returns the linear light of an sRGB component; both are in 0 .. 1.
inline double linear_from_srgb(double c) {
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

}  // namespace fivepipe::base
