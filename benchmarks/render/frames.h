// The frames that the suite draws: a hand circles above the table of deployment paper, and the view
// follows it.
#pragma once
#include <optional>
#include <vector>

#include "common/config/deployment.h"
#include "render_node/particle_points.h"
#include "render_node/views/tile_assembler.h"

namespace fivepipe::render_bench {

// The hand circles once in these frames.
inline constexpr int kFrames = 30;

// The silhouettes of the hand in frame f.
std::vector<hull::Silhouette> silhouettes_of(const config::Deployment& deployment, int f);

// What the nodes send for a frame.
struct Frame {
  render::HullFrame hull;  // with a colour that differs from pixel to pixel, or without
  std::optional<render::HullFrame> light_hull;  // present if the scene has shadows
};
// Times of the hull queries on one thread.
struct QueryTimes {
  std::vector<double> viewer_ms, light_ms;  // the viewer's includes the preparation of the maps
};

// Returns frame f and adds its times.
Frame frame_of(const config::Deployment& deployment, int f, bool coloured, QueryTimes& times);

// Particles in a box above the table; none if the scene has no source.
std::vector<render::ParticleCloud> particles_of(const config::Scene& scene, int f);

}  // namespace fivepipe::render_bench
