#include "benchmarks/features/scene_run.h"

#include <chrono>
#include <cstdint>
#include <opencv2/core.hpp>
#include <set>
#include <span>
#include <string>

#include "benchmarks/render/oracle/hull_pixel.h"
#include "capture_node/synthetic/world.h"
#include "common/base/timing.h"
#include "common/config/views.h"
#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::feature_bench {
namespace {

using Clock = std::chrono::steady_clock;

// The grey level of the hull's colour. The renderer lights a hull without colour in every scene, so
// that lit real objects would cost nothing.
constexpr std::uint8_t kHullLevel = 160;

// The hand's capsules; the pipe is one, too.
std::vector<hull::Silhouette> silhouettes_at(const config::Deployment& deployment, double time_s) {
  const auto& capture = std::get<config::CaptureConfig>(deployment.nodes.front().config);
  std::vector<hull::Capsule> hand;
  for (const capture::SyntheticPart& part : capture::synthetic_parts(capture.synthetic, time_s))
    if (const auto* capsule = std::get_if<hull::Capsule>(&part.shape)) hand.push_back(*capsule);
  std::vector<hull::Silhouette> silhouettes;
  for (const std::size_t i : config::shape_cameras(deployment.rig)) {
    const geometry::Camera camera = config::published_camera(deployment.rig.cameras[i]);
    silhouettes.push_back(
        {camera, hull::true_object_pixels(hand, camera, hull::PixelRule::touched)});
  }
  return silhouettes;
}

// The exact hull in a view, without colour.
render::HullFrame hull_in(const hull::View& view, hull::CpuHull& query) {
  const geometry::Pinhole& k = view.camera.pinhole;
  return render::frame_of_depths(view.camera,
                                 query.depth(view, {0, 0, k.width_px, k.height_px}).depth_m);
}

const config::SimConfig& sim_config(const config::Deployment& deployment) {
  for (const config::Node& node : deployment.nodes)
    if (const auto* config = std::get_if<config::SimConfig>(&node.config)) return *config;
  throw std::invalid_argument("the deployment has no sim_node");
}

config::SimConfig with_threads(config::SimConfig config, int threads) {
  config.threads = threads;
  return config;
}

// FNV-1a, 64 bits.
class Checksum {
 public:
  void add(std::span<const std::byte> bytes) {
    for (const std::byte byte : bytes) sum_ = (sum_ ^ std::uint64_t(byte)) * 0x100000001b3;
  }
  void add(const Eigen::Vector3d& v) { add(std::as_bytes(std::span(v.data(), 3))); }
  std::uint64_t value() const { return sum_; }

 private:
  std::uint64_t sum_ = 0xcbf29ce484222325;
};

}  // namespace

std::vector<RealFrame> real_frames(const config::Deployment& with_shadows, int count) {
  const config::Viewer& viewer = with_shadows.viewer;
  const config::HullView light = config::light_view(with_shadows.scene).value();
  base::WorkerPool pool(1);
  std::vector<RealFrame> frames;
  for (int f = 0; f < count; ++f) {
    RealFrame& frame = frames.emplace_back();
    frame.time_s = f / with_shadows.frame_rate_hz;
    frame.silhouettes = silhouettes_at(with_shadows, frame.time_s);
    hull::CpuHull query(pool, frame.silhouettes, with_shadows.hull_rule);
    frame.hull = hull_in({{config::recon_pinhole(viewer), config::eye_from_world_at(viewer, 0)},
                          viewer.near_m,
                          viewer.far_m},
                         query);
    frame.hull.bgr.assign(3 * frame.hull.depth_m.size(), kHullLevel);
    frame.light_hull = hull_in({{light.recon, *light.fixed}, light.near_m, light.far_m}, query);
    frame.hull.frame = frame.light_hull.frame = std::uint64_t(f);
  }
  return frames;
}

SceneRun::SceneRun(const config::Deployment& deployment, int threads)
    : deployment_(deployment),
      simulation_(deployment_.scene, with_threads(sim_config(deployment_), threads),
                  deployment_.rig.volume_m),
      renderer_(deployment_.scene, deployment_.viewer) {}

double SceneRun::advance(const RealFrame& frame) {
  const Clock::time_point start = Clock::now();
  simulation_.advance_to(frame.time_s, frame.silhouettes);
  return 1e3 * base::seconds_since(start);
}

double SceneRun::draw(const RealFrame& frame) {
  std::set<std::string> colliding;
  for (const sim::CollisionReport& report : simulation_.collisions())
    if (report.collision.colliding()) colliding.insert(report.name);
  const std::vector<render::ObjectPose> drawn = poses();
  const std::vector<render::ParticleCloud> particles = clouds();
  const Clock::time_point start = Clock::now();
  renderer_.draw(frame.hull, drawn, colliding, particles,
                 deployment_.scene.shadows ? &frame.light_hull : nullptr);
  renderer_.finish();
  return 1e3 * base::seconds_since(start);
}

// As sim_node sends them: the objects that move.
std::vector<render::ObjectPose> SceneRun::poses() const {
  std::vector<render::ObjectPose> poses;
  const std::vector<sim::ObjectState> states = simulation_.states();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (deployment_.scene.objects[i].motion == config::Motion::fixed) continue;
    render::ObjectPose& pose = poses.emplace_back();
    pose.object = states[i].name;
    pose.world_from_object = states[i].world_from_object;
    for (const Eigen::Vector3d& v : states[i].vertices_m)
      pose.vertices_m.insert(pose.vertices_m.end(), {float(v.x()), float(v.y()), float(v.z())});
  }
  return poses;
}

std::vector<render::ParticleCloud> SceneRun::clouds() const {
  std::vector<render::ParticleCloud> clouds;
  for (std::size_t i = 0; i < deployment_.scene.particles.size(); ++i) {
    render::ParticleCloud& cloud = clouds.emplace_back();
    cloud.source = i;
    for (const Eigen::Vector3d& p : simulation_.particles(i).p_world_m)
      cloud.p_world_m.insert(cloud.p_world_m.end(), {float(p.x()), float(p.y()), float(p.z())});
  }
  return clouds;
}

std::uint64_t SceneRun::checksum() const {
  Checksum sum;
  for (const sim::ObjectState& state : simulation_.states()) {
    for (int column = 0; column < 4; ++column)
      sum.add(Eigen::Vector3d(state.world_from_object.matrix().col(column).head<3>()));
    for (const Eigen::Vector3d& v : state.vertices_m) sum.add(v);
  }
  for (std::size_t i = 0; i < deployment_.scene.particles.size(); ++i)
    for (const Eigen::Vector3d& p : simulation_.particles(i).p_world_m) sum.add(p);
  const cv::Mat image = renderer_.image_bgr();
  for (int v = 0; v < image.rows; ++v)
    sum.add(std::as_bytes(std::span(image.ptr(v), std::size_t(image.cols) * image.elemSize())));
  return sum.value();
}

}  // namespace fivepipe::feature_bench
