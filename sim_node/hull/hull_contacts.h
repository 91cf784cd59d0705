// The contacts with the hull at the end of a frame, for reports.
#pragma once
#include <cstddef>

namespace fivepipe::sim {

struct HullContacts {
  std::size_t count = 0;
  double deepest_m = 0;  // the deepest penetration that the solver knows of [m]; 0: none
};

}  // namespace fivepipe::sim
