// The accuracy with which the recorded simulation detected collisions.
#pragma once
#include "common/config/deployment.h"

namespace fivepipe::study {

// Returns SimConfig::eps_m of the deployment's sim_node, or its default without one.
inline double detection_eps_m(const config::Deployment& deployment) {
  for (const config::Node& node : deployment.nodes)
    if (const auto* sim = std::get_if<config::SimConfig>(&node.config)) return sim->eps_m;
  return config::SimConfig{}.eps_m;
}

}  // namespace fivepipe::study
