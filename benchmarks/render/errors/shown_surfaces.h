// Which surface each pixel of a drawn frame shows.
#pragma once
#include <deque>
#include <opencv2/core/mat.hpp>
#include <span>

#include "render_node/renderer.h"

namespace fivepipe::render_bench {

// The numbers of a scene's surfaces in images of surfaces.
struct SurfaceNumbers {
  explicit SurfaceNumbers(const config::Scene& scene);

  int object(std::size_t index) const { return 1 + int(index); }
  int particle(std::size_t source) const { return 1 + objects + int(source); }

  static constexpr int kBackground = 0;
  int objects;
  int bits;  // of the largest number, which is the hull's
  int hull;  // all bits set
};

// Draws each frame once per bit of the numbers: in white the surfaces that have the bit, in black
// the others. The renderer orders the surfaces as in the frame itself, because their order does not
// depend on colours. Needs a current GL context from construction to destruction.
class ShownSurfaces {
 public:
  ShownSurfaces(const config::Scene& scene, const config::Viewer& viewer);

  // Returns the numbers of the surfaces that render::Renderer::draw() shows, CV_16U.
  cv::Mat of(const render::HullFrame& hull, std::span<const render::ParticleCloud> particles = {},
             const render::HullFrame* light_hull = nullptr);

  const SurfaceNumbers& numbers() const { return numbers_; }

 private:
  SurfaceNumbers numbers_;
  std::deque<render::Renderer> renderers_;  // by bit
};

}  // namespace fivepipe::render_bench
