// One camera's part of a captured frame.
#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/realtime.h"
#include "common/hull/colour_region.h"
#include "common/hull/coverage/coverage_outline.h"
#include "common/hull/object_pixels.h"

namespace fivepipe::capture {

enum class CaptureStatus {
  captured,
  missing,  // no image of this frame; `reason` explains why
  ended,    // no image follows: the file has ended, and config.loop is false, or the stream has
};

struct CapturedCamera {
  std::string camera;  // its name in the rig
  CaptureStatus status = CaptureStatus::captured;
  std::string reason;  // empty if captured
  // In the published geometry. Only cameras that give shape have it; of a missing image, only with
  // config.lost_camera `go_on`.
  std::optional<hull::ObjectPixels> pixels;
  // Of `pixels`, if config.coverage; absent if the camera has no image, and every pixel is an
  // object pixel.
  std::optional<hull::CoverageOutline> outline;
  // Only cameras that give colour have it, if the caller wants colour and the camera sees a part of
  // the hull that the viewer or a spectator can see. Absent in all cameras if the hull is empty:
  // with Limits::all, if one camera sees no object pixels.
  std::optional<hull::ColourRegion> colour;
  // CLOCK_REALTIME at which the camera took the image. All sources without a clock of their own
  // (files, synthetic cameras, precomputed frames) have the same time, see capture().
  std::int64_t image_stamp_ns = 0;
  bool has_clock = false;  // the camera states that time itself
  // Diagnostics of this camera's object pixels, for the user.
  std::vector<std::string> diagnostics;
  // Time to read the image, and to compute pixels and colour from it.
  double read_s = 0, segment_s = 0;
  double segment_cpu_s = 0;  // CPU time of the latter

  bool has_image() const { return status == CaptureStatus::captured && image_stamp_ns != 0; }
};

// The stamp of a set's earliest image; none if no camera has an image.
inline std::optional<std::int64_t> earliest_stamp_ns(const std::vector<CapturedCamera>& set) {
  std::optional<std::int64_t> earliest;
  for (const CapturedCamera& camera : set)
    if (camera.has_image() && (!earliest || camera.image_stamp_ns < *earliest))
      earliest = camera.image_stamp_ns;
  return earliest;
}

// A camera that is not triggered with the others is up to one period of its own behind them.
inline constexpr double kMaxLatePeriods = 1.5;
// Adds a diagnostic to the cameras of a set whose images are more than kMaxLatePeriods older than
// the newest one. Only cameras that state the time of their images are compared.
inline void name_late_cameras(std::vector<CapturedCamera>& set, double frame_rate_hz) {
  std::int64_t newest_ns = 0;
  for (const CapturedCamera& camera : set)
    if (camera.has_image() && camera.has_clock)
      newest_ns = std::max(newest_ns, camera.image_stamp_ns);
  for (CapturedCamera& camera : set)
    if (camera.has_image() && camera.has_clock &&
        base::difference_s(newest_ns, camera.image_stamp_ns) > kMaxLatePeriods / frame_rate_hz)
      camera.diagnostics.push_back(
          "late: its image is more than 1.5 frame periods older than those of other cameras");
}

}  // namespace fivepipe::capture
