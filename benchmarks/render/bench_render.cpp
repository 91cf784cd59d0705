// fivepipe bench render: the time in which the parent pipe draws and reads back a frame at the
// paper's sizes.
#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <random>

#include "benchmarks/hull/scenes.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
#include "common/config/views.h"
#include "common/gl/context.h"
#include "common/hull/cpu/cpu_hull.h"
#include "render_node/renderer.h"

namespace fivepipe::render_bench {
namespace {

using Clock = std::chrono::steady_clock;

double cpu_ms() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * double(t.tv_sec) + 1e-6 * double(t.tv_nsec);
}

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// The hand circles above the table once in these frames, and the view follows it.
constexpr int kFrames = 30;
constexpr double kSecondsPerFrame = 8.0 / kFrames;

// The silhouettes of the hand in frame f.
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

// The exact hull in a view.
render::HullFrame hull_in(const hull::View& view, hull::CpuHull& query) {
  render::HullFrame hull;
  hull.eye_from_world = view.camera.camera_from_world;
  hull.recon = view.camera.pinhole;
  const int width = hull.recon.width_px, height = hull.recon.height_px;
  hull.depth_m = query.depth(view, {0, 0, width, height}).depth_m;
  hull.covered = {width, height, 0, 0};
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      if (hull.depth_m[std::size_t(v * width + u)] != hull::kNoHull)
        hull.covered = {std::min(hull.covered.u0_px, u), std::min(hull.covered.v0_px, v),
                        std::max(hull.covered.u1_px, u + 1), std::max(hull.covered.v1_px, v + 1)};
  return hull;
}

// What the nodes send for a frame.
struct Frame {
  render::HullFrame hull;  // with a colour that differs from pixel to pixel
  std::optional<render::HullFrame> light_hull;
};
struct QueryTimes {
  std::vector<double> viewer_ms, light_ms;  // the viewer's includes the preparation of the maps
};

Frame frame_of(const config::Deployment& deployment, int f, bool coloured, QueryTimes& times) {
  const auto silhouettes = silhouettes_of(deployment, f);
  base::WorkerPool pool(1);
  const Clock::time_point start = Clock::now();
  hull::CpuHull query(pool, silhouettes);
  Frame frame{hull_in({{config::recon_pinhole(deployment.viewer),
                        config::eye_from_world_at(deployment.viewer, f * kSecondsPerFrame)},
                       deployment.viewer.near_m,
                       deployment.viewer.far_m},
                      query),
              {}};
  times.viewer_ms.push_back(ms_since(start));
  frame.hull.frame = std::uint64_t(f);
  if (const auto light = config::light_view(deployment.scene)) {
    const Clock::time_point light_start = Clock::now();
    frame.light_hull = hull_in({{light->recon, *light->fixed}, light->near_m, light->far_m}, query);
    times.light_ms.push_back(ms_since(light_start));
  }
  const int width = frame.hull.recon.width_px, height = frame.hull.recon.height_px;
  for (int i = 0; coloured && i < width * height; ++i)
    frame.hull.bgr.insert(frame.hull.bgr.end(), {std::uint8_t(i % width), std::uint8_t(i / width),
                                                 std::uint8_t(200 - i % 7)});
  return frame;
}

// Particles in a box above the table.
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

// FNV-1a, 64 bits.
std::uint64_t mixed(std::uint64_t sum, const cv::Mat& image) {
  for (int v = 0; v < image.rows; ++v)
    for (const std::uint8_t* byte = image.ptr(v);
         byte < image.ptr(v) + image.cols * int(image.elemSize()); ++byte)
      sum = (sum ^ *byte) * 0x100000001b3;
  return sum;
}

struct Times {
  std::vector<double> draw_ms, read_ms, frame_ms;
  // CPU time of the whole process, including llvmpipe's threads. Other processes affect it less
  // than the wall time.
  std::vector<double> cpu_ms;
};

Times measure(const config::Deployment& deployment, const std::vector<Frame>& frames, int rounds,
              std::uint64_t& sum) {
  render::Renderer renderer(deployment.scene, deployment.viewer);
  Times times;
  for (int i = -kFrames; i < rounds * kFrames; ++i) {  // the checksum is of the warm-up round
    const Frame& frame = frames[std::size_t((i + kFrames) % kFrames)];
    const auto particles = particles_of(deployment.scene, i + kFrames);
    const double cpu_before_ms = cpu_ms();
    const Clock::time_point start = Clock::now();
    renderer.draw(frame.hull, {}, {"touched_block"}, particles,
                  frame.light_hull ? &*frame.light_hull : nullptr);
    renderer.finish();
    const double draw_ms = ms_since(start);
    const cv::Mat image = renderer.image_bgr();
    const double frame_ms = ms_since(start), frame_cpu_ms = cpu_ms() - cpu_before_ms;
    if (i < 0) {
      sum = mixed(sum, image);
      continue;
    }
    times.draw_ms.push_back(draw_ms);
    times.read_ms.push_back(frame_ms - draw_ms);
    times.frame_ms.push_back(frame_ms);
    times.cpu_ms.push_back(frame_cpu_ms);
  }
  return times;
}

struct Result {
  std::string name;  // "coloured"
  Times times;
  QueryTimes queries;
  std::uint64_t checksum = 0xcbf29ce484222325;
};

// A feature of the scene, on top of those that it has.
struct Variant {
  std::string name;
  bool coloured = true, lit = false, shadows = false, particles = false;
};

config::Deployment with(config::Deployment deployment, const Variant& variant) {
  deployment.scene.lights_real_objects = variant.lit;
  if (variant.shadows)
    deployment.scene.shadows =
        config::ShadowView{.target_world_m = {0, 0, 0.1}, .fov_rad = 50 * M_PI / 180};
  if (variant.particles) deployment.scene.particles.resize(1);
  return deployment;
}

Result measured(const config::Deployment& plain, const Variant& variant, const bench::Args& args) {
  const config::Deployment deployment = with(plain, variant);
  Result result{.name = variant.name, .times = {}, .queries = {}};
  std::vector<Frame> frames;
  for (int f = 0; f < kFrames; ++f)
    frames.push_back(frame_of(deployment, f, variant.coloured, result.queries));
  result.times = measure(deployment, frames, args.quick ? 1 : 5, result.checksum);
  return result;
}

void print(const std::vector<Result>& results) {
  base::TextTable table({{"ms"},
                         {"draw", true},
                         {"read", true},
                         {"both", true},
                         {"p95", true},
                         {"p99", true},
                         {"cpu", true}});
  const auto ms = [](const std::vector<double>& values, double p) {
    return base::with_decimals(base::percentile(values, p), 2);
  };
  for (const auto& [name, times, queries, checksum] : results)
    table.add({name, ms(times.draw_ms, 0.5), ms(times.read_ms, 0.5), ms(times.frame_ms, 0.5),
               ms(times.frame_ms, 0.95), ms(times.frame_ms, 0.99), ms(times.cpu_ms, 0.5)});
  std::cout << table.text();
  for (const Result& result : results)
    if (!result.queries.light_ms.empty()) {
      std::cout << fmt::format(
          "hull query, one thread: {:.2f} ms for the viewer, {:.2f} ms more for the light\n",
          base::percentile(result.queries.viewer_ms, 0.5),
          base::percentile(result.queries.light_ms, 0.5));
      break;
    }
}

nlohmann::ordered_json json_of(const Result& result, int threads) {
  const Times& times = result.times;
  nlohmann::ordered_json json = {{"name", fmt::format("render/{}/{}", result.name, threads)},
                                 {"time_ms", base::times_json(times.frame_ms)},
                                 {"draw_ms", base::times_json(times.draw_ms)},
                                 {"read_back_ms", base::times_json(times.read_ms)},
                                 {"cpu_ms", base::times_json(times.cpu_ms)},
                                 {"checksum", fmt::format("{:x}", result.checksum)}};
  if (!result.queries.light_ms.empty()) {
    json["viewer_query_ms"] = base::times_json(result.queries.viewer_ms);
    json["light_query_ms"] = base::times_json(result.queries.light_ms);
  }
  return json;
}

constexpr bench::Suite kSuite{
    .name = "render",
    .description =
        "Measures how long the parent pipe draws and reads back a frame of deployment paper: with "
        "a "
        "coloured hull and with a grey one; with shadows of virtual objects and of the hull; with "
        "light on the hull; with both; and with 10,000 particles.",
    .example = "fivepipe bench render --json out/render.json",
    .only_help = "only results whose name contains this text, such as shadows"};

void run(const bench::Args& args) {
  const config::Deployment deployment =
      config::load_deployment(std::string(FIVEPIPE_SOURCE_DIR) + "/launch/deployments/paper.yaml");
  const gl::GlContext gl;
  std::cout << base::machine_line(gl.renderer()) << std::endl;
  std::vector<Result> results;
  nlohmann::ordered_json entries = nlohmann::ordered_json::array();
  for (const Variant& variant :
       {Variant{.name = "coloured"}, Variant{.name = "grey", .coloured = false},
        Variant{.name = "shadows", .shadows = true}, Variant{.name = "lit", .lit = true},
        Variant{.name = "lit_shadows", .lit = true, .shadows = true},
        Variant{.name = "particles", .particles = true}}) {
    if (variant.name.find(args.only) == std::string::npos) continue;
    results.push_back(measured(deployment, variant, args));
    entries.push_back(json_of(results.back(), args.threads));
  }
  print(results);
  if (!args.json_file.empty())
    base::write_json(args.json_file, base::suite_json("render", gl.renderer(), entries));
}

}  // namespace
}  // namespace fivepipe::render_bench

int main(int argc, char** argv) {
  return fivepipe::bench::run_suite(fivepipe::render_bench::kSuite, argc, argv,
                                    fivepipe::render_bench::run);
}
