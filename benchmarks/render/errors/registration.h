// Registration: where the avatar is drawn against where the object is when the frame is composited.
#pragma once
#include <string>

#include "benchmarks/render/errors/outline.h"

namespace fivepipe::render_bench {

// One step from the object to the drawn avatar, with the errors of all steps up to it.
struct RegistrationStage {
  std::string name;  // "hull"
  std::string text;  // what it adds, for the table
  // Distances between the outlines of the drawn avatar and of the true object [mm].
  std::vector<double> outline_mm;
  std::vector<double> centroid_mm;  // one per frame
  // What it adds: distances between the outlines drawn in this stage and in the one before; of
  // latency, between those of the true object then and now.
  std::vector<double> added_mm;
};

// The speed at which the object moves in the last stage, along the rows of the view.
inline constexpr double kSpeed_m_s = 1;

// Returns the stages:
//   renderer  draws the true object's depth, sampled in the reconstruction's pixels
//   hull      draws the hull of exact silhouettes of the deployment's cameras
//   map       draws the hull of the maps that capture_node's segmentation makes
//   latency   the same; the object has meanwhile moved at kSpeed_m_s for `latency_s`
// Throws std::runtime_error if a camera that gives shape does not see the whole object, because the
// hull then lacks a part. Needs a current GL context.
std::vector<RegistrationStage> registration(Actor& actor, std::span<const ActorFrame> frames,
                                            double latency_s);

// The object, moved along the rows of the frame's view.
std::vector<hull::Capsule> moved_in_view(std::vector<hull::Capsule> object,
                                         const Eigen::Isometry3d& eye_from_world, double by_m);

}  // namespace fivepipe::render_bench
