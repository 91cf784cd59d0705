// fivepipe bench hull: how fast, and how right, the hull's depth is from a novel viewpoint, by backend.
// Methods of one scene and size run in turn within one process, so that the machine's mood meets all alike.
#include <cstdlib>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <sstream>
#include <thread>

#include "common/gl/context.h"
#include "common/hull/bench_scene.h"
#include "common/hull/exact_depth.h"
#include "common/hull/plane_sweep.h"
#include "common/hull/reference.h"
#include "common/version/version.h"

namespace fivepipe::bench {
namespace {

constexpr double kNear_m = 0.2, kFar_m = 1.2;         // the paper's queried volume is about a metre deep
constexpr double kSurfaceStep_m = 0.5e-3;             // in which the analytic hull's first point is bracketed before bisection
constexpr std::size_t kReferenceRays = 6000, kSurfaceRays = 300;  // seeded subsets of the rays

struct Method {
  std::string name;
  std::function<DepthTile(const HullScene&, const View&)> depth;  // preparation of the maps included
  int runs;
  double plane_spacing_mm = 0;
};

struct Errors {
  // Against the exact hull of the same maps, by the reference: of the rays that both hit, without the wrong pieces and with them.
  std::vector<double> depth_mm, any_piece_mm;
  int wrong_hits = 0, wrong_misses = 0, wrong_pieces = 0;  // wrong_pieces: passed through the first piece and hit one more than a plane spacing behind
  int rays = 0, reference_hits = 0;
  std::vector<double> surface_mm;  // against the hull of the true silhouettes
};

struct Result {
  std::string name;
  std::vector<double> time_ms;
  Errors errors;
  int hits = 0;
  std::uint64_t checksum = 0;
  double covered = 0, footprint_mm = 0;
};

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, std::size_t(std::ceil(p * double(values.size()))) - (p > 0))];
}

std::uint64_t checksum(const std::vector<float>& depths) {  // FNV-1a over the bits
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const float d : depths) {
    std::uint32_t bits;
    std::memcpy(&bits, &d, sizeof bits);
    for (int shift = 0; shift < 32; shift += 8) hash = (hash ^ (bits >> shift & 0xff)) * 0x100000001b3;
  }
  return hash;
}

// First point of the hull of the true silhouettes along a ray; what is thinner than kSurfaceStep_m may be missed.
std::optional<double> analytic_depth_m(const HullScene& scene, const std::vector<Camera>& cameras, const Ray& ray) {
  const auto inside = [&](double t) { return in_analytic_hull(scene.object, cameras, ray.origin_world_m + t * ray.direction_world); };
  for (double t = kNear_m; t < kFar_m; t += kSurfaceStep_m) {
    if (!inside(t)) continue;
    double out = t - kSurfaceStep_m, in = t;
    for (int i = 0; i < 20; ++i) (inside(0.5 * (out + in)) ? in : out) = 0.5 * (out + in);
    return in;
  }
  return std::nullopt;
}

Errors errors_of(const HullScene& scene, const View& view, const DepthTile& tile, double spacing_mm) {
  std::vector<Camera> cameras;
  for (const Silhouette& s : scene.silhouettes) cameras.push_back(s.camera);
  Errors errors;
  std::mt19937_64 random(1);
  const int width = tile.rect.width_px();
  std::size_t surface_rays = 0;
  for (std::size_t n = 0; n < kReferenceRays; ++n) {
    const std::size_t i = random() % tile.depth_m.size();
    const int u = int(i) % width, v = int(i) / width;
    const Ray ray = ray_through(view.camera, Eigen::Vector2d(u, v));
    const auto pieces = reference_intervals(scene.silhouettes, ray, view.near_m, view.far_m);
    const double depth_m = tile.depth_m[i];
    const bool hit = tile.depth_m[i] != kNoHull, expected = !pieces.empty();
    ++errors.rays;
    errors.reference_hits += expected;
    errors.wrong_hits += hit && !expected;
    errors.wrong_misses += !hit && expected;
    if (hit && expected) {
      const double error_mm = std::abs(depth_m - pieces.front().enter) * 1000;
      errors.any_piece_mm.push_back(error_mm);
      if (float(pieces.front().leave) < tile.depth_m[i] && error_mm > spacing_mm) ++errors.wrong_pieces;
      else errors.depth_mm.push_back(error_mm);
    }
    if (hit && surface_rays < kSurfaceRays) {
      ++surface_rays;
      if (const auto surface = analytic_depth_m(scene, cameras, ray)) errors.surface_mm.push_back(std::abs(depth_m - *surface) * 1000);
    }
  }
  return errors;
}

std::vector<Result> measure(const HullScene& scene, int width_px, int height_px, std::span<const Method> methods) {
  const View view{{pinhole_from_fov(width_px, height_px, 1.0), scene.camera_from_world_of_eye}, kNear_m, kFar_m};
  std::vector<Result> results(methods.size());
  std::vector<DepthTile> tiles(methods.size());
  const int rounds = std::max_element(methods.begin(), methods.end(), [](const Method& a, const Method& b) { return a.runs < b.runs; })->runs;
  for (int round = -1; round < rounds; ++round)  // the first, uncounted, warms up
    for (std::size_t m = 0; m < methods.size(); ++m) {
      if (round >= methods[m].runs) continue;
      const auto start = std::chrono::steady_clock::now();
      tiles[m] = methods[m].depth(scene, view);
      const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
      if (round >= 0) results[m].time_ms.push_back(ms);
    }
  for (std::size_t m = 0; m < methods.size(); ++m) {
    Result& r = results[m];
    r.name = methods[m].name + "/" + scene.name + "/" + std::to_string(width_px) + "x" + std::to_string(height_px) + "/1";
    r.hits = int(std::count_if(tiles[m].depth_m.begin(), tiles[m].depth_m.end(), [](float d) { return d != kNoHull; }));
    r.errors = errors_of(scene, view, tiles[m], methods[m].plane_spacing_mm);
    r.checksum = checksum(tiles[m].depth_m);
    r.covered = covered_fraction(scene);
    r.footprint_mm = 1000 * pixel_footprint_m(scene);
  }
  return results;
}

// --- report ----------------------------------------------------------------------------------------------------

void print(const std::vector<Result>& results) {
  std::printf("%-31s %9s %8s %8s %4s | %9s %9s %9s %9s %9s %5s %5s %6s | %8s %8s %9s | %s\n", "method/scene/view/threads", "ms median", "p95", "p99", "runs", "depth mm", "p99",
              "p99.9", "max", "any p99", "+hit", "-hit", "-piece", "surface", "p95 mm", "footprint", "checksum");
  for (const Result& r : results) {
    const Errors& e = r.errors;
    std::printf("%-31s %9.2f %8.2f %8.2f %4zu | %9.5f %9.5f %9.5f %9.5f %9.5f %5d %5d %6d | %8.3f %8.3f %9.3f | %016llx\n", r.name.c_str(), percentile(r.time_ms, 0.5),
                percentile(r.time_ms, 0.95), percentile(r.time_ms, 0.99), r.time_ms.size(), percentile(e.depth_mm, 0.5), percentile(e.depth_mm, 0.99),
                percentile(e.depth_mm, 0.999), percentile(e.depth_mm, 1),
                percentile(e.any_piece_mm, 0.99), e.wrong_hits, e.wrong_misses, e.wrong_pieces, percentile(e.surface_mm, 0.5),
                percentile(e.surface_mm, 0.95), r.footprint_mm, (unsigned long long)r.checksum);
  }
  std::printf("depth: against the exact hull of the same maps, %zu seeded rays of each view; +hit -hit: rays that hit or miss wrongly; -piece: rays that pass through\n"
              "the hull's first piece and hit one more than a plane spacing behind (only in any p99); surface: against the hull of the true silhouettes, %zu rays\n"
              "planes are %.2f mm apart with 64, %.2f mm with 256\n", kReferenceRays, kSurfaceRays, (kFar_m - kNear_m) * 1000 / 64, (kFar_m - kNear_m) * 1000 / 256);
}

std::string quoted(const std::string& text) {
  std::string json = "\"";
  for (const char c : text)
    if (c == '"' || c == '\\') (json += '\\') += c;
    else if (std::uint8_t(c) >= 0x20) json += c;
  return json + "\"";
}

std::string cpu_name() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

// By hand, not by a library: this benchmark also builds where only a compiler, Eigen, epoxy and EGL are.
std::string json_of(const std::vector<Result>& results, const std::string& renderer) {
  std::ostringstream out;
  out << "{\"suite\": \"hull\", \"commit\": " << quoted(commit()) << ",\n \"machine\": {\"cpu\": " << quoted(cpu_name()) << ", \"cores\": " << std::thread::hardware_concurrency()
      << ", \"gl_renderer\": " << quoted(renderer) << ", \"build_type\": " << quoted(build_type()) << "},\n \"results\": [";
  for (const Result& r : results) {
    const Errors& e = r.errors;
    out << (&r == results.data() ? "\n" : ",\n") << "  {\"name\": " << quoted(r.name) << ", \"time_ms\": {\"median\": " << percentile(r.time_ms, 0.5)
        << ", \"p95\": " << percentile(r.time_ms, 0.95) << ", \"p99\": " << percentile(r.time_ms, 0.99) << ", \"runs\": " << r.time_ms.size() << "},\n   \"error\": {\"depth_median_mm\": "
        << percentile(e.depth_mm, 0.5) << ", \"depth_p99_mm\": " << percentile(e.depth_mm, 0.99) << ", \"depth_p999_mm\": " << percentile(e.depth_mm, 0.999)
        << ", \"depth_max_mm\": " << percentile(e.depth_mm, 1) << ", \"depth_any_piece_p99_mm\": " << percentile(e.any_piece_mm, 0.99) << ", \"surface_median_mm\": " << percentile(e.surface_mm, 0.5) << ", \"surface_p95_mm\": "
        << percentile(e.surface_mm, 0.95) << ", \"pixel_footprint_mm\": " << r.footprint_mm << "},\n   \"counts\": {\"hits\": " << r.hits << ", \"reference_rays\": " << e.rays
        << ", \"reference_hits\": " << e.reference_hits << ", \"wrong_hits\": " << e.wrong_hits << ", \"wrong_misses\": " << e.wrong_misses << ", \"wrong_pieces\": " << e.wrong_pieces << ", \"covered_percent\": " << 100 * r.covered
        << "}, \"checksum\": \"" << std::hex << r.checksum << std::dec << "\"}";
  }
  out << "\n ]}\n";
  return out.str();
}

// --- methods ---------------------------------------------------------------------------------------------------

Method exact_method(int runs) {
  return {"exact", [](const HullScene& scene, const View& view) { return exact_depth(scene.silhouettes, view, {0, 0, view.camera.pinhole.width_px, view.camera.pinhole.height_px}); }, runs};
}

Method sweep_method(int width_px, int height_px, int planes, int runs) {
  return {"sweep" + std::to_string(planes),
          [sweep = std::make_shared<PlaneSweep>(width_px, height_px, planes)](const HullScene& scene, const View& view) {
            sweep->set_silhouettes(scene.silhouettes);
            return sweep->depth(view, {view.near_m, view.far_m}, {0, 0, view.camera.pinhole.width_px, view.camera.pinhole.height_px});
          },
          runs, (kFar_m - kNear_m) * 1000 / planes};
}

struct Args {
  std::string json_file;
  bool quick = false;
};

void run(const Args& args) {
  const GlContext context;
  std::printf("%s, %u cores, %s, build %s %s\n", cpu_name().c_str(), std::thread::hardware_concurrency(), context.renderer().c_str(), build_type(), commit());
  std::vector<Result> results;
  // Fields of view at which the object covers 5 and 15 percent of the maps.
  for (const HullScene& scene : {hand_scene("hand4", 0.68), hand_scene("hand4-near", 0.395)}) {
    std::printf("%s: object pixels cover %.1f %% of the maps\n", scene.name.c_str(), 100 * covered_fraction(scene));
    for (const auto& [width_px, height_px] : {std::array{320, 240}, {640, 480}}) {
      const Method methods[] = {exact_method(args.quick ? 5 : 101), sweep_method(width_px, height_px, 64, args.quick ? 2 : 31),
                                sweep_method(width_px, height_px, 256, args.quick ? 1 : 15)};
      for (Result& r : measure(scene, width_px, height_px, methods)) results.push_back(std::move(r));
    }
  }
  print(results);
  if (args.json_file.empty()) return;
  std::ofstream file(args.json_file);
  file << json_of(results, context.renderer());
  if (!file.flush()) throw std::runtime_error("cannot write " + args.json_file);
}

constexpr const char* kHelp =
    "fivepipe bench hull [--json FILE] [--quick]\n"
    "Time and error of the visual hull's depth from a novel viewpoint: backends `exact` and `sweep` (64 and 256 planes over 1 m), four maps of 720x486.\n";

}  // namespace
}  // namespace fivepipe::bench

int main(int argc, char** argv) {
  setenv("LP_NUM_THREADS", "1", 0);  // llvmpipe's: the methods are compared on one thread
  fivepipe::bench::Args args;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quick") args.quick = true;
    else if (word == "--json" && i + 1 < argc) args.json_file = argv[++i];
    else if (word == "--help" || word == "-h") return std::fputs(fivepipe::bench::kHelp, stdout), 0;
    else return std::fprintf(stderr, "unknown argument %s\n%s", argv[i], fivepipe::bench::kHelp), 2;
  }
  try {
    fivepipe::bench::run(args);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bench hull: %s\n", e.what());
    return 1;
  }
}
