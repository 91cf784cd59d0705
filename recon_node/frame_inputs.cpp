#include "recon_node/frame_inputs.h"

#include <utility>

namespace fivepipe::recon {

bool FrameInputs::add(messages::FramePose pose, std::uint64_t writer) {
  constexpr std::size_t kHead = 0;  // the only source of poses
  const frames::CameraWriters::Verdict verdict = pose_writers_.judge(kHead, writer);
  if (!verdict.is_current) return false;
  if (verdict.replaced) restart_detector_ = frames::RestartDetector(frames::RestartBy::writer);
  if (restart_detector_.is_restart(pose.frame, pose.capture_stamp_ns) || verdict.replaced) {
    poses_.clear();
    colours_.clear();
  }
  poses_.get_or_add(pose.frame).value = std::move(pose);
  return true;
}

const char* FrameInputs::add(messages::CameraColour colour, std::uint64_t writer) {
  const frames::CameraWriters::Verdict verdict = colour_writers_.judge(colour.camera, writer);
  if (!verdict.is_current) return "other_writer";
  // Frames with the same number that a restarted capture_node sent before show other images.
  if (verdict.replaced)
    for (auto& [frame, of_frame] : colours_)
      std::erase_if(of_frame,
                    [&](const auto& kept) { return kept.second.writer == *verdict.replaced; });
  ColourOfCamera& of_frame = colours_.get_or_add(colour.frame).value;
  const bool is_new =
      of_frame.insert_or_assign(colour.camera, Colour{writer, std::move(colour.colour)}).second;
  return is_new ? nullptr : "repeated_colour";
}

std::vector<hull::ColourRegion> FrameInputs::take_colours(std::uint64_t frame) {
  std::vector<hull::ColourRegion> colours;
  std::optional<ColourOfCamera> of_frame = colours_.take(frame);
  if (!of_frame) return colours;
  for (auto& [camera, colour] : *of_frame) colours.push_back(std::move(colour.region));
  return colours;
}

void FrameInputs::reset() {
  poses_.clear();
  colours_.clear();
  restart_detector_ = frames::RestartDetector(frames::RestartBy::writer);
  pose_writers_ = colour_writers_ = {};
}

}  // namespace fivepipe::recon
