#include "benchmarks/render/frames.h"

#include <chrono>
#include <cmath>
#include <random>

#include "benchmarks/hull/scenes.h"
#include "benchmarks/render/oracle/hull_pixel.h"
#include "common/base/timing.h"
#include "common/config/views.h"
#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::render_bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSecondsPerFrame = 8.0 / kFrames;

// The exact hull in a view. Appends the time of the query since `start` [ms].
render::HullFrame hull_in(const hull::View& view, hull::CpuHull& query, Clock::time_point start,
                          std::vector<double>& times_ms) {
  const geometry::Pinhole& k = view.camera.pinhole;
  std::vector<float> depth_m = query.depth(view, {0, 0, k.width_px, k.height_px}).depth_m;
  times_ms.push_back(1e3 * base::seconds_since(start));
  return render::frame_of_depths(view.camera, std::move(depth_m));
}

}  // namespace

std::vector<hull::Silhouette> silhouettes_of(const config::Deployment& deployment, int f) {
  const double angle = 2 * M_PI * f / kFrames;
  const Eigen::Vector3d hand_world_m(0.15 * std::sin(angle), 0.05 + 0.1 * std::cos(angle), 0.12);
  std::vector<hull::Capsule> object = hull_bench::hand_and_forearm();
  const Eigen::AngleAxisd forward(
      M_PI / 2, Eigen::Vector3d::UnitZ());  // the arm reaches in from the person's side
  for (hull::Capsule& part : object)
    for (Eigen::Vector3d* end : {&part.a_world_m, &part.b_world_m})
      *end = forward * *end + hand_world_m;
  std::vector<hull::Silhouette> silhouettes;
  for (const config::RigCamera& camera : deployment.rig.cameras) {
    if (camera.mount != config::Mount::world) continue;
    const geometry::Camera placed = config::published_camera(camera);
    silhouettes.push_back(
        {placed, hull::true_object_pixels(object, placed, hull::PixelRule::touched)});
  }
  return silhouettes;
}

Frame frame_of(const config::Deployment& deployment, int f, bool coloured, QueryTimes& times) {
  const auto silhouettes = silhouettes_of(deployment, f);
  base::WorkerPool pool(1);
  const Clock::time_point start = Clock::now();
  hull::CpuHull query(pool, silhouettes, deployment.hull_rule);
  Frame frame{hull_in({{config::recon_pinhole(deployment.viewer),
                        config::eye_from_world_at(deployment.viewer, f * kSecondsPerFrame)},
                       deployment.viewer.near_m,
                       deployment.viewer.far_m},
                      query, start, times.viewer_ms),
              {}};
  frame.hull.frame = std::uint64_t(f);
  if (const auto light = config::light_view(deployment.scene))
    frame.light_hull = hull_in({{light->recon, *light->fixed}, light->near_m, light->far_m}, query,
                               Clock::now(), times.light_ms);
  const int width = frame.hull.recon.width_px, height = frame.hull.recon.height_px;
  for (int i = 0; coloured && i < width * height; ++i)
    frame.hull.bgr.insert(frame.hull.bgr.end(), {std::uint8_t(i % width), std::uint8_t(i / width),
                                                 std::uint8_t(200 - i % 7)});
  return frame;
}

std::vector<render::ParticleCloud> particles_of(const config::Scene& scene, int f) {
  if (scene.particles.empty()) return {};
  constexpr int kParticles = 10'000;
  render::ParticleCloud cloud;
  std::mt19937 random{std::uint32_t(f)};
  const auto unit = [&] { return float(random() % 10'000) / 10'000 - 0.5f; };
  for (int i = 0; i < kParticles; ++i)
    cloud.p_world_m.insert(cloud.p_world_m.end(),
                           {0.6f * unit(), 0.4f * unit(), 0.2f + 0.4f * unit()});
  return {cloud};
}

}  // namespace fivepipe::render_bench
