// A simulation and a renderer of one scene, with the time of each frame in both.
#pragma once
#include <cstdint>
#include <vector>

#include "common/config/deployment.h"
#include "render_node/renderer.h"
#include "sim_node/simulation/simulation.h"

namespace fivepipe::feature_bench {

// A frame of the real world: the same for every scene.
struct RealFrame {
  double time_s;
  std::vector<hull::Silhouette> silhouettes;
  // Exact. hull: as the viewer sees it, with colour; light_hull: in the view of the scene's
  // shadows.
  render::HullFrame hull, light_hull;
};

// The frames of the deployment's cameras, viewer and light, which must exist. Its capture_node is
// synthetic, and the frame rate is the deployment's.
std::vector<RealFrame> real_frames(const config::Deployment& with_shadows, int count);

// Needs a current GL context from construction to destruction.
class SceneRun {
 public:
  SceneRun(const config::Deployment& deployment, int threads);

  // Each returns its time in ms: of all steps up to the frame, with the preparation of its hull;
  // of drawing the frame as advance() left the scene, without reading it back.
  double advance(const RealFrame& frame);
  double draw(const RealFrame& frame);

  // Of the states of all objects and particles, and of the last image.
  std::uint64_t checksum() const;

  std::vector<double> steps_ms, draw_ms;  // for the caller, one per frame

 private:
  std::vector<render::ObjectPose> poses() const;
  std::vector<render::ParticleCloud> clouds() const;

  config::Deployment deployment_;
  sim::Simulation simulation_;
  render::Renderer renderer_;
};

}  // namespace fivepipe::feature_bench
