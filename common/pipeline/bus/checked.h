// Error check of Cyclone DDS calls.
#pragma once
#include <dds/dds.h>

#include <string>

#include "common/pipeline/bus/bus.h"

namespace fivepipe::bus::detail {

// Returns the result of a call of Cyclone DDS. Throws BusError if it is an error code.
inline dds_return_t checked(dds_return_t result, const std::string& what) {
  if (result < 0) throw BusError(what + ": " + dds_strretcode(-result));
  return result;
}

}  // namespace fivepipe::bus::detail
