#include "recon_node/spectators.h"

namespace fivepipe::recon {

Spectators::Spectators(const config::Deployment& deployment)
    : frame_rate_hz_(deployment.frame_rate_hz) {
  for (const config::Node& node : deployment.nodes)
    if (const config::Viewer* const viewer = config::spectator_of(node))
      spectators_.push_back({*viewer});
}

void Spectators::set_readers(const std::set<std::string>& nodes) {
  for (Spectator& spectator : spectators_)
    spectator.is_there = nodes.contains(spectator.viewer.name);
}

std::vector<PosedView> Spectators::views_at(std::uint64_t frame) const {
  std::vector<PosedView> views;
  for (const Spectator& spectator : spectators_) {
    if (!spectator.is_there) continue;
    const Eigen::Isometry3d head =
        config::eye_from_world_at(spectator.viewer, double(frame) / frame_rate_hz_);
    for (config::HullView& view : config::eye_views(spectator.viewer))
      views.push_back({view, config::eye_from_world(view, head)});
  }
  return views;
}

}  // namespace fivepipe::recon
