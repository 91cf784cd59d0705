// What each program reads from the bus. A test holds it against what running nodes read.
#pragma once
#include <set>
#include <string>

#include "common/pipeline/bus/topics.h"

namespace fivepipe::replay {

// Topic names; none for a program that is not known.
inline std::set<std::string> inputs_of(const std::string& program) {
  using namespace bus::topics;
  if (program == "capture_node") return {TileCosts::name, FrameComposited::name};
  if (program == "recon_node")
    return {ReplaySession::name, CameraInfo::name,   ViewInfo::name,
            HeadPose::name,      ObjectColour::name, ObjectPixelMap::name};
  if (program == "sim_node")
    return {ReplaySession::name, CameraInfo::name, bus::topics::Command::name,
            ObjectPixelMap::name};
  if (program == "render_node")
    return {ReplaySession::name, CollisionResult::name, VirtualState::name, HullTile::name};
  return {};
}

// And what it makes of them.
inline std::set<std::string> outputs_of(const std::string& program) {
  using namespace bus::topics;
  if (program == "capture_node")
    return {CameraInfo::name, ViewInfo::name, HeadPose::name, ObjectColour::name,
            ObjectPixelMap::name};
  if (program == "recon_node") return {HullTile::name, TileCosts::name};
  if (program == "sim_node")
    return {CollisionResult::name, VirtualState::name, HullComponents::name};
  if (program == "render_node") return {FrameComposited::name};
  return {};
}

// What of a frame the program waits for before it works: it must come after all else of the frame.
inline bool triggers_work(const std::string& topic) {
  return topic == bus::topics::ObjectPixelMap::name || topic == bus::topics::HullTile::name;
}

}  // namespace fivepipe::replay
