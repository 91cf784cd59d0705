// The hull and the detection of a recorded simulation.
#pragma once
#include <vector>

#include "common/config/deployment.h"

namespace fivepipe::study {

// Returns SimConfig::eps_m of the deployment's sim_node, or its default without one.
inline double detection_eps_m(const config::Deployment& deployment) {
  for (const config::Node& node : deployment.nodes)
    if (const auto* sim = std::get_if<config::SimConfig>(&node.config)) return sim->eps_m;
  return config::SimConfig{}.eps_m;
}

// Returns the cameras whose images all points of the hull must be in.
inline std::vector<geometry::Camera> limiting_cameras(const config::Deployment& deployment) {
  std::vector<geometry::Camera> cameras;
  if (deployment.hull_rule.limits == hull::Limits::all)
    for (const std::size_t i : config::shape_cameras(deployment.rig))
      cameras.push_back(config::published_camera(deployment.rig.cameras[i]));
  return cameras;
}

}  // namespace fivepipe::study
