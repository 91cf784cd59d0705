// The views of the spectators that are there: render_nodes of their own (RenderConfig::viewer).
#pragma once
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "common/config/views.h"

namespace fivepipe::recon {

// A view of one frame with the pose of its eye.
struct PosedView {
  config::HullView of;
  Eigen::Isometry3d eye_from_world;
};

// A spectator is there while its node reads tiles; the hull is reconstructed only for those.
class Spectators {
 public:
  explicit Spectators(const config::Deployment& deployment);

  // Returns whether the deployment has none.
  bool empty() const { return spectators_.empty(); }
  // nodes: the names of all nodes that read tiles.
  void set_readers(const std::set<std::string>& nodes);
  // Returns the views of the spectators that are there, in the order of the deployment. The pose
  // depends on the number of the frame only, so that all recon_nodes and replays agree.
  std::vector<PosedView> views_at(std::uint64_t frame) const;

 private:
  struct Spectator {
    config::Viewer viewer;  // with the name of its node
    bool is_there = false;
  };
  double frame_rate_hz_;
  std::vector<Spectator> spectators_;
};

}  // namespace fivepipe::recon
