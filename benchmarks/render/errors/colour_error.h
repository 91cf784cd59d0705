// The avatar's colour beside that of the true object.
#pragma once
#include <memory>

#include "benchmarks/render/errors/avatar.h"
#include "capture_node/synthetic/surroundings.h"

namespace fivepipe::render_bench {

// The image of the true object from the frame's eye, without noise, of the size that the renderer
// draws.
cv::Mat true_image_bgr(const config::Viewer& viewer, const config::SyntheticWorld& world,
                       const ActorFrame& frame,
                       std::shared_ptr<const capture::Surroundings> surroundings);

// Absolute differences of the three channels in grey levels of 255, three per pixel, at the pixels
// where both images show the object and at least one of the cameras sees the true surface point.
// true_bgr: of the size of `drawn`.
std::vector<double> colour_differences(const Drawn& drawn, const cv::Mat& true_bgr,
                                       std::span<const hull::Capsule> object,
                                       std::span<const geometry::Camera> colour_cameras);

// The cameras of the rig that give colour, at the frame.
std::vector<geometry::Camera> colour_cameras(const config::Rig& rig, const ActorFrame& frame);

// The differences over all frames. Needs a current GL context.
std::vector<double> avatar_colour_differences(Actor& actor, std::span<const ActorFrame> frames);

}  // namespace fivepipe::render_bench
