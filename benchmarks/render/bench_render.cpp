// fivepipe bench render: the time in which the parent pipe draws and reads back a frame at the
// paper's sizes.
#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "benchmarks/hull/scenes.h"
#include "benchmarks/support/suite.h"
#include "common/base/result_file.h"
#include "common/base/text_table.h"
#include "common/base/timing.h"
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

// Returns the hull that the reconstruction nodes send for frame f: exact depth, and a color that
// differs from pixel to pixel.
render::HullFrame hull_of(const config::Deployment& deployment, int f, bool coloured) {
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
  render::HullFrame hull;
  hull.frame = std::uint64_t(f);
  hull.eye_from_world = config::eye_from_world_at(deployment.viewer, f * kSecondsPerFrame);
  hull.recon = config::recon_pinhole(deployment.viewer);
  base::WorkerPool pool(1);
  hull::CpuHull query(pool, silhouettes);
  const int width = hull.recon.width_px, height = hull.recon.height_px;
  hull.depth_m = query
                     .depth({{hull.recon, hull.eye_from_world},
                             deployment.viewer.near_m,
                             deployment.viewer.far_m},
                            {0, 0, width, height})
                     .depth_m;
  hull.covered = {width, height, 0, 0};
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      if (hull.depth_m[std::size_t(v * width + u)] != hull::kNoHull)
        hull.covered = {std::min(hull.covered.u0_px, u), std::min(hull.covered.v0_px, v),
                        std::max(hull.covered.u1_px, u + 1), std::max(hull.covered.v1_px, v + 1)};
  if (!coloured) return hull;
  for (int i = 0; i < width * height; ++i)
    hull.bgr.insert(hull.bgr.end(),
                    {std::uint8_t(i % width), std::uint8_t(i / width), std::uint8_t(200 - i % 7)});
  return hull;
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

Times measure(const config::Deployment& deployment, const std::vector<render::HullFrame>& hulls,
              int rounds, std::uint64_t& sum) {
  render::Renderer renderer(deployment.scene, deployment.viewer);
  Times times;
  for (int i = -kFrames; i < rounds * kFrames; ++i) {  // the checksum is of the warm-up round
    const double cpu_before_ms = cpu_ms();
    const Clock::time_point start = Clock::now();
    renderer.draw(hulls[std::size_t((i + kFrames) % kFrames)], {}, {"touched_block"});
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
  std::uint64_t checksum = 0xcbf29ce484222325;
};

Result measured(const config::Deployment& deployment, bool coloured, const bench::Args& args) {
  std::vector<render::HullFrame> hulls;
  for (int f = 0; f < kFrames; ++f) hulls.push_back(hull_of(deployment, f, coloured));
  Result result{.name = coloured ? "coloured" : "grey", .times = {}};
  result.times = measure(deployment, hulls, args.quick ? 1 : 5, result.checksum);
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
  for (const auto& [name, times, checksum] : results)
    table.add({name, ms(times.draw_ms, 0.5), ms(times.read_ms, 0.5), ms(times.frame_ms, 0.5),
               ms(times.frame_ms, 0.95), ms(times.frame_ms, 0.99), ms(times.cpu_ms, 0.5)});
  std::cout << table.text();
}

nlohmann::ordered_json json_of(const Result& result, int threads) {
  const Times& times = result.times;
  return {{"name", fmt::format("render/{}/{}", result.name, threads)},
          {"time_ms", base::times_json(times.frame_ms)},
          {"draw_ms", base::times_json(times.draw_ms)},
          {"read_back_ms", base::times_json(times.read_ms)},
          {"cpu_ms", base::times_json(times.cpu_ms)},
          {"checksum", fmt::format("{:x}", result.checksum)}};
}

constexpr bench::Suite kSuite{
    .name = "render",
    .description =
        "Measures how long the parent pipe draws and reads back a frame of deployment "
        "paper, with a coloured hull and with a grey one.",
    .example = "fivepipe bench render --json out/render.json"};

void run(const bench::Args& args) {
  const config::Deployment deployment =
      config::load_deployment(std::string(FIVEPIPE_SOURCE_DIR) + "/launch/deployments/paper.yaml");
  const gl::GlContext gl;
  std::cout << base::machine_line(gl.renderer()) << std::endl;
  std::vector<Result> results;
  nlohmann::ordered_json entries = nlohmann::ordered_json::array();
  for (const bool coloured : {true, false}) {
    results.push_back(measured(deployment, coloured, args));
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
