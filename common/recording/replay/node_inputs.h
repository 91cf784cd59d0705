// Topics that each program reads and writes, and the views of their HullTiles. A test compares the
// topics with those of running nodes.
#pragma once
#include <set>
#include <string>

#include "common/config/deployment.h"
#include "common/config/views.h"
#include "common/pipeline/bus/topics.h"

namespace fivepipe::replay {

// Names of the topics that the program reads for a scene, without sub-pixel silhouettes; empty for
// an unknown program. follows: as a capture_node that captures the frames of another one.
inline std::set<std::string> inputs_of(const std::string& program, const config::Scene& scene,
                                       bool follows = false) {
  using namespace bus::topics;
  if (program == "capture_node")
    return {follows ? HeadPose::name : TileCosts::name, FrameComposited::name};
  if (program == "recon_node")
    return {ReplaySession::name, CameraInfo::name,   ViewInfo::name,
            HeadPose::name,      ObjectColour::name, ObjectPixelMap::name};
  if (program == "sim_node") {
    std::set<std::string> inputs{ReplaySession::name, CameraInfo::name, bus::topics::Command::name,
                                 ObjectPixelMap::name};
    if (config::has_spacings(scene)) inputs.insert({ObjectSpacing::name, SpacingRequest::name});
    return inputs;
  }
  if (program == "render_node") {
    std::set<std::string> inputs{ReplaySession::name, CollisionResult::name, VirtualState::name,
                                 HullTile::name};
    if (!scene.particles.empty()) inputs.insert(Particles::name);
    return inputs;
  }
  return {};
}

// Names of the topics that the program writes for a scene, without NodeStatus and FrameTrace, and
// without sub-pixel silhouettes.
inline std::set<std::string> outputs_of(const std::string& program, const config::Scene& scene,
                                        bool follows = false) {
  using namespace bus::topics;
  if (program == "capture_node") {
    std::set<std::string> outputs{CameraInfo::name, ObjectColour::name, ObjectPixelMap::name};
    if (!follows) outputs.insert({ViewInfo::name, HeadPose::name});
    return outputs;
  }
  if (program == "recon_node") return {HullTile::name, TileCosts::name};
  if (program == "sim_node") {
    std::set<std::string> outputs{CollisionResult::name, VirtualState::name};
    if (!scene.particles.empty()) outputs.insert(Particles::name);
    if (scene.history) outputs.insert(HullComponents::name);
    if (config::moves_objects(scene)) outputs.insert(SimulationMetrics::name);
    if (config::has_spacings(scene)) outputs.insert(ObjectSpacing::name);
    return outputs;
  }
  if (program == "render_node") return {FrameComposited::name};
  return {};
}

// Whether the node is a render_node whose window has keys for the spacings of the scene.
inline bool has_spacing_keys(const config::Deployment& deployment, const config::Node& node) {
  const auto* const render = std::get_if<config::RenderConfig>(&node.config);
  return render != nullptr && render->window && config::has_spacings(deployment.scene);
}

// The topics of a node of the deployment.
inline bool follows(const config::Deployment& deployment, const config::Node& node) {
  return std::holds_alternative<config::CaptureConfig>(node.config) &&
         config::first_capture_node(deployment)->name != node.name;
}
inline std::set<std::string> inputs_of(const config::Deployment& deployment,
                                       const config::Node& node) {
  const std::string program = config::program_of(node);
  std::set<std::string> inputs = inputs_of(program, deployment.scene, follows(deployment, node));
  if (deployment.coverage && (program == "recon_node" || program == "sim_node"))
    inputs.insert(bus::topics::ObjectCoverage::name);
  if (has_spacing_keys(deployment, node)) inputs.insert(bus::topics::ObjectSpacing::name);
  return inputs;
}
inline std::set<std::string> outputs_of(const config::Deployment& deployment,
                                        const config::Node& node) {
  const std::string program = config::program_of(node);
  std::set<std::string> outputs = outputs_of(program, deployment.scene, follows(deployment, node));
  if (deployment.coverage && program == "capture_node")
    outputs.insert(bus::topics::ObjectCoverage::name);
  if (has_spacing_keys(deployment, node)) outputs.insert(bus::topics::SpacingRequest::name);
  if (config::spectator_of(node)) outputs.erase(bus::topics::FrameComposited::name);
  return outputs;
}

// Returns the names of the views whose tiles complete a frame for this render_node; empty for
// another program.
inline std::set<std::string> hull_view_names(const config::Deployment& deployment,
                                             const config::Node& node) {
  std::set<std::string> names;
  if (!std::holds_alternative<config::RenderConfig>(node.config)) return names;
  const config::Viewer* const spectator = config::spectator_of(node);
  for (const config::HullView& view :
       config::hull_views(deployment.scene, spectator ? *spectator : deployment.viewer))
    names.insert(view.name);
  return names;
}

// True for the topics whose messages start the work on a frame; a frame's other messages must
// arrive before them.
inline bool triggers_work(const std::string& topic) {
  return topic == bus::topics::ObjectPixelMap::name || topic == bus::topics::HullTile::name;
}

}  // namespace fivepipe::replay
