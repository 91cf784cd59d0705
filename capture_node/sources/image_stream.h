// A stream of one camera's images, which the thread of a live source (live_source.h) opens, reads
// and closes. The modules of optional libraries implement it (stream_modules.h), so this header
// needs no library of fivepipe.
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "capture_node/sources/source_error.h"

namespace fivepipe::capture {

// `what` names the cause and what to do next, but neither the camera nor the device.
struct StreamFault {
  SourceFault fault;
  std::string what;
};

struct NextImage {
  enum class Status {
    image,
    none,    // no image yet: call next() again
    lost,    // the camera or its stream has ended; open() may bring it back
    failed,  // the same, and open() is of no use
    end,     // no image follows, as at the end of a file
  };
  Status status = Status::none;
  cv::Mat bgr;                // of `image`: 8-bit BGR. The stream keeps no reference to it
  std::int64_t taken_ns = 0;  // CLOCK_REALTIME at which the camera took it
  std::string why;            // of `lost` and `failed`, and of `none` if there is a reason
};

// One thread calls the functions of a stream, and destroys it.
class ImageStream {
 public:
  virtual ~ImageStream() = default;  // closes the stream
  // Opens the stream, also again after `lost`. Returns the fault if that is not possible.
  virtual std::optional<StreamFault> open() = 0;
  // Waits for the newest image, at most 0.1 s if the driver does not block. Only after open().
  virtual NextImage next() = 0;
};

}  // namespace fivepipe::capture
