#include "capture_node/synthetic/actors/part.h"

namespace fivepipe::capture {

SyntheticPart moved(const Eigen::Isometry3d& motion, SyntheticPart part) {
  if (auto* capsule = std::get_if<hull::Capsule>(&part.shape)) {
    capsule->a_world_m = motion * capsule->a_world_m;
    capsule->b_world_m = motion * capsule->b_world_m;
  } else {
    auto& box = std::get<geometry::OrientedBox>(part.shape);
    box.world_from_box = motion * box.world_from_box;
  }
  return part;
}

}  // namespace fivepipe::capture
