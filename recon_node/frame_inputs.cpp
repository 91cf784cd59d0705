#include "recon_node/frame_inputs.h"

#include <utility>

#include "common/base/realtime.h"

namespace fivepipe::recon {

bool FrameInputs::add(messages::FramePose pose, std::uint64_t writer) {
  constexpr std::size_t kHead = 0;  // the only source of poses
  const frames::CameraWriters::Verdict verdict = writers_.judge(kHead, writer);
  if (!verdict.is_current) return false;
  if (verdict.replaced) restart_detector_ = frames::RestartDetector(frames::RestartBy::writer);
  if (restart_detector_.is_restart(pose.frame, pose.capture_stamp_ns) || verdict.replaced) {
    poses_.clear();
    colours_.clear();
  }
  poses_.get_or_add(pose.frame).value = std::move(pose);
  return true;
}

bool FrameInputs::add(messages::CameraColour colour) {
  ColourOfCamera& of_frame = colours_.get_or_add(colour.frame).value;
  const std::size_t camera = colour.camera;
  return of_frame.insert_or_assign(camera, std::move(colour)).second;
}

std::vector<hull::ColourRegion> FrameInputs::take_colours(std::uint64_t frame,
                                                          std::int64_t capture_stamp_ns) {
  std::vector<hull::ColourRegion> colours;
  std::optional<ColourOfCamera> of_frame = colours_.take(frame);
  if (!of_frame) return colours;
  for (auto& [camera, colour] : *of_frame)
    if (base::distance_ns(colour.capture_stamp_ns, capture_stamp_ns) <
        frames::RestartDetector::kMinRestart_ns)
      colours.push_back(std::move(colour.colour));
  return colours;
}

void FrameInputs::reset() {
  poses_.clear();
  colours_.clear();
  restart_detector_ = frames::RestartDetector(frames::RestartBy::writer);
  writers_ = {};
}

}  // namespace fivepipe::recon
