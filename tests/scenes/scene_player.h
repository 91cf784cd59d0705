// Plays a deployment with synthetic cameras in one process, without DDS: calls the libraries of its
// nodes frame by frame. The same calls give the same bits.
#pragma once
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "capture_node/capture.h"
#include "capture_node/synthetic/world.h"
#include "common/config/deployment.h"
#include "common/config/views.h"
#include "recon_node/reconstruct.h"
#include "render_node/renderer.h"
#include "sim_node/simulation/simulation.h"

namespace fivepipe::test {

// Returns launch/deployments/NAME.yaml.
config::Deployment shipped_deployment(const std::string& name);

// Returns the configuration of the first node of the deployment with one of this type. Throws
// std::invalid_argument if there is none.
template <class Config>
const Config& node_config(const config::Deployment& deployment) {
  for (const config::Node& node : deployment.nodes)
    if (const auto* config = std::get_if<Config>(&node.config)) return *config;
  throw std::invalid_argument(deployment.name + " lacks a node");
}

// Needs a current OpenGL context from construction to destruction. Reconstructs by backend `cpu`,
// whose hull is the same on every machine.
class ScenePlayer {
 public:
  explicit ScenePlayer(const config::Deployment& deployment);

  // Simulates these frames against the exact silhouettes of the actor: a pixel is set if its center
  // is in the silhouette. Without noise and segmentation, a frame takes little time.
  void simulate(std::int64_t first_frame, std::int64_t last_frame);

  // Returns the composite of the last simulated frame. Its hull has the exact silhouettes and the
  // actor's colours.
  cv::Mat composite();
  // The same with the maps and colours that capture_node computes from the images of the synthetic
  // cameras. The first call takes about a second per camera.
  cv::Mat composite_of_images();

 private:
  std::vector<capture::SyntheticPart> parts_now() const;
  cv::Mat composite(std::span<const hull::Silhouette> silhouettes,
                    std::span<const hull::ColourRegion> colours);
  render::HullFrame seen_hull(const hull::View& view, std::span<const hull::Silhouette> silhouettes,
                              std::span<const hull::ColourRegion> colours);
  std::vector<render::ObjectPose> poses() const;
  std::set<std::string> highlighted() const;
  std::vector<render::ParticleCloud> particles() const;
  double time_s() const { return double(frame_) / deployment_.frame_rate_hz; }

  config::Deployment deployment_;
  std::optional<config::HullView> light_;  // present if the scene has shadows
  std::int64_t frame_ = 0;
  std::vector<hull::Silhouette> silhouettes_;  // the simulation refers to them
  sim::Simulation simulation_;
  recon::Reconstructor reconstructor_;
  render::Renderer renderer_;
  std::optional<capture::Capture> capture_;  // opened by composite_of_images()
};

}  // namespace fivepipe::test
