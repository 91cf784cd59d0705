#include "benchmarks/sim/particle_rain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/timing.h"
#include "common/hull/oracle/analytic.h"

namespace fivepipe::sim_bench {
namespace {

using Eigen::Vector3d;

// Particles that fall on a strip along x. `count` of them exist from 2 s after the start on.
config::Scene rain(int count, double half_width_m) {
  constexpr double kLifetime_s = 2;
  config::SceneObject table;  // below the block
  table.name = "table";
  table.shape = config::BoxShape{{2, 2, 0.02}};
  table.world_from_object.translation() << 0, 0, -0.21;
  table.reaction = config::Reaction::none;
  config::ParticleSource source;
  source.name = "rain";
  source.from_world_m = {Vector3d(-half_width_m, -0.28, 0.15), Vector3d(half_width_m, 0.28, 0.2)};
  source.lifetime_s = kLifetime_s;
  source.rate_hz = count / kLifetime_s;
  config::Scene scene;
  scene.name = "rain";
  scene.objects = {table};
  scene.particles = {source};
  return scene;
}

// The silhouettes of a block, 60 cm wide, whose top is at z = 0, and of an arm, 6 cm thick, across
// it, which moves to and fro along x at 1 m/s.
std::vector<hull::Silhouette> seen(double time_s, const std::vector<geometry::Camera>& cameras) {
  constexpr double kWay_m = 0.4;
  const double turn_m = std::fmod(time_s, 2 * kWay_m),
               x_m = (turn_m < kWay_m ? turn_m : 2 * kWay_m - turn_m) - 0.5 * kWay_m;
  const geometry::OrientedBox block{Eigen::Isometry3d(Eigen::Translation3d(0, 0, -0.1)),
                                    {0.3, 0.3, 0.1}};
  const hull::Capsule arm{{x_m, -0.4, 0.03}, {x_m, 0.2, 0.03}, 0.03};
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : cameras) {
    hull::ObjectPixels pixels = hull::true_object_pixels(block, camera);
    hull::true_object_pixels({&arm, 1}, camera, hull::PixelRule::center)
        .for_each_run({0, 0, pixels.width_px(), pixels.height_px()},
                      [&](int v, int begin, int end) { pixels.set_run(begin, end, v); });
    silhouettes.push_back({camera, pixels});
  }
  return silhouettes;
}

// Returns the depth of the deepest particle in the hull by its definition: the shortest way out
// along an axis, in steps of 0.1 mm, at most 0.1 m.
double deepest_m(const std::vector<hull::Silhouette>& silhouettes, const sim::ParticleSet& of) {
  constexpr double kReach_m = 0.1, kStep_m = 1e-4;
  double deepest_m = 0;
  for (const Vector3d& p_m : of.p_world_m) {
    if (!hull::in_hull(silhouettes, p_m)) continue;
    double nearest_m = kReach_m;
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0}) {
        double way_m = 0;
        while (way_m < nearest_m &&
               hull::in_hull(silhouettes, p_m + way_m * side * Vector3d::Unit(axis)))
          way_m += kStep_m;
        nearest_m = std::min(nearest_m, way_m);
      }
    deepest_m = std::max(deepest_m, nearest_m);
  }
  return deepest_m;
}

}  // namespace

std::string particles_name(int count, Rain rain_on) {
  return fmt::format("particles/{}{}", count, rain_on == Rain::block ? "" : "/wide");
}

Result swept_particles(int count, Rain rain_on, int threads, bool is_quick) {
  const auto cameras = cameras_at(5, 0);
  const bool on_block = rain_on == Rain::block;
  sim::Simulation simulation(rain(count, on_block ? 0.28 : 0.8), {.threads = threads});
  Result result, ignored;
  result.name = particles_name(count, rain_on);
  const int full = 61, frames = full + (is_quick ? 10 : 60);
  double worst_m = 0;
  std::vector<double> contacts;  // per step
  std::vector<hull::Silhouette> silhouettes;
  for (int frame = 0; frame <= frames; ++frame) {
    silhouettes = seen(frame * kFrame_s, cameras);
    const std::uint64_t before = simulation.counters().particles.contacts;
    advance(simulation, frame, silhouettes, frame < full ? ignored : result);
    if (frame < full) continue;
    contacts.push_back(double(simulation.counters().particles.contacts - before) / kStepsPerFrame);
    worst_m = std::max(worst_m, deepest_m(silhouettes, simulation.particles(0)));
  }
  const sim::ParticleCounters counters = simulation.counters().particles;
  const double touching = base::percentile(contacts, 0.5);
  result.error = {{"deepest_mm", 1e3 * worst_m}};
  result.counts = {{"particles", simulation.particles(0).size()},
                   {"contacts_per_step", touching},
                   {"stuck", counters.stuck}};
  result.errors = fmt::format("{:.2f} mm deep; {:.0f} in contact with the hull, {} removed from it",
                              1e3 * worst_m, touching, counters.stuck);
  return result;
}

}  // namespace fivepipe::sim_bench
