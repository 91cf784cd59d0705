// The tables of an export, as CSV.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/collision/tracking/component_tracker.h"
#include "launch/export/frame_export.h"

namespace fivepipe::exports {

// Which frame a line belongs to.
struct FrameTime {
  std::size_t index;  // of the complete frames of the recording, from 0
  std::uint64_t frame;
  std::int64_t capture_stamp_ns;
  double time_s;  // since the first complete frame
  double duration_s;
};

// The first lines; each line ends with a newline.
std::string frames_head();
std::string components_head();
std::string views_head();

std::string frame_line(const FrameTime& time, const FrameFigures& figures);
// One line per component.
std::string component_lines(const FrameTime& time,
                            const std::vector<collision::TrackedComponent>& components);
std::string view_line(const FrameTime& time, const geometry::Camera& camera);

}  // namespace fivepipe::exports
