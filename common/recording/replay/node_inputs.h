// Topics that each program reads and writes. A test compares them with those of running nodes.
#pragma once
#include <set>
#include <string>

#include "common/pipeline/bus/topics.h"

namespace fivepipe::replay {

// Names of the topics that the program reads; empty for an unknown program.
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

// Names of the topics that the program writes, without NodeStatus and FrameTrace.
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

// True for the topics whose messages start the work on a frame; a frame's other messages must
// arrive before them.
inline bool triggers_work(const std::string& topic) {
  return topic == bus::topics::ObjectPixelMap::name || topic == bus::topics::HullTile::name;
}

}  // namespace fivepipe::replay
