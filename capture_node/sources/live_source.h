// The image source of a camera that delivers images while fivepipe runs.
#pragma once
#include <chrono>
#include <memory>
#include <string>

#include "capture_node/sources/image_source.h"
#include "capture_node/sources/image_stream.h"

namespace fivepipe::capture {

struct LiveSourceSettings {
  std::string name;  // of the device, at the start of every message
  // Time for open() and the first image.
  std::chrono::milliseconds first_image_timeout{5000};
  // The likely cause if no image arrives in that time and the stream reports none.
  std::string silence = "the device does not respond as a camera";
};

// Opens the stream on a thread of its own, which keeps the newest image, and returns the source
// after the first one. After `lost` wait_for_image() does not wait, and the thread tries every 0.5
// s to open the stream again, until the camera is back.
//
// The destructor waits at most 1 s for the thread, also if stop() was called before. A thread that
// a driver blocks then goes on alone, and ends after its next image.
//
// Throws the fault of open(), HardwareMissing if no image arrives, and SourceError if the images
// have another size than camera.source.
std::unique_ptr<ImageSource> open_live_source(const config::RigCamera& camera,
                                              LiveSourceSettings settings,
                                              std::unique_ptr<ImageStream> stream);

}  // namespace fivepipe::capture
