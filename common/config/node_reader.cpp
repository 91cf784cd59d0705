#include "common/config/node_reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/machine.h"
#include "common/config/capture/source_reader.h"
#include "common/config/segmentation_reader.h"
#include "common/config/view/viewer_reader.h"

namespace fivepipe::config {

namespace {

constexpr Range kCount{0, kUnbounded}, kAtLeastOne{1, kUnbounded};
constexpr Range kLevels{0, 255};  // grey levels
constexpr Range kCores{0, 1023};  // CPUs of a Linux cpu_set_t

// Returns true if the node runs on this machine. Files of other hosts cannot be checked here.
bool runs_here(const std::string& host) { return host.empty() || host == base::host_name(); }

// Reports a text other than "synthetic".
void check_synthetic(YamlMap& map, const std::string& key) {
  enum class Kind { synthetic };
  map.choice<Kind>(key, {{"synthetic", Kind::synthetic}});
}

// Reads `sources: synthetic` (all cameras of the rig that give shape or colour), or a mapping from
// camera to `synthetic` or to the keys of one source.
std::map<std::string, CameraSource> read_sources(YamlMap& map, const Rig& rig, ParsedNode& parsed) {
  std::map<std::string, CameraSource> sources;
  if (map.is_text("sources")) {
    check_synthetic(map, "sources");
    for (const RigCamera& camera : rig.cameras)
      if (camera.gives_shape || camera.gives_colour) {
        sources[camera.name] = SyntheticSource{};
        parsed.source_locations[camera.name] = map.location_of("sources");
      }
    return sources;
  }
  YamlMap by_camera = map.map("sources");
  for (const std::string& camera : by_camera.keys()) {
    if (std::find(rig.left_out.begin(), rig.left_out.end(), camera) != rig.left_out.end()) continue;
    parsed.source_locations[camera] = by_camera.location_of(camera);
    if (by_camera.is_text(camera)) {
      check_synthetic(by_camera, camera);
      sources[camera] = SyntheticSource{};
    } else {
      sources[camera] = read_source(by_camera.map(camera), runs_here(parsed.node.host));
    }
  }
  return sources;
}

SyntheticWorld read_synthetic_world(YamlMap map) {
  SyntheticWorld world;
  world.actor =
      map.choice<SyntheticActor>("actor",
                                 {{"hand_with_pipe", SyntheticActor::hand_with_pipe},
                                  {"parting_hands", SyntheticActor::parting_hands},
                                  {"hand_with_tray", SyntheticActor::hand_with_tray},
                                  {"pushing_hand", SyntheticActor::pushing_hand},
                                  {"catching_hand", SyntheticActor::catching_hand},
                                  {"pipe_task", SyntheticActor::pipe_task},
                                  {"reaching_arm", SyntheticActor::reaching_arm},
                                  {"reaching_and_leaning", SyntheticActor::reaching_and_leaning}},
                                 world.actor);
  if (map.has("hand_length_m") && !has_hand_length(world.actor))
    map.problem_at("hand_length_m",
                   "hand_length_m has no effect on this actor: its hand has one size");
  // From that of a child of six years to that of the largest adults.
  world.hand_length_m = map.number("hand_length_m", {0.12, 0.25}, world.hand_length_m);
  if (map.has("tool") && world.actor != SyntheticActor::pipe_task)
    map.problem_at("tool", "tool has no effect without actor pipe_task");
  world.tool = map.choice<SyntheticTool>(
      "tool", {{"none", SyntheticTool::none}, {"tongs", SyntheticTool::tongs}}, world.tool);
  world.seed = std::uint64_t(map.integer64("seed", kCount, std::int64_t(world.seed)));
  world.period_s = map.number("period_s", {0.1, 3600}, world.period_s);
  world.noise_sigma_levels = map.number("noise_sigma_levels", kLevels, world.noise_sigma_levels);
  world.cast_shadow = map.flag("cast_shadow", world.cast_shadow);
  world.supersampling = map.integer("supersampling", {1, 4}, world.supersampling);
  world.prerender = map.flag("prerender", world.prerender);
  map.finish();
  return world;
}

CaptureConfig read_capture(YamlMap& map, const Rig& rig, ParsedNode& parsed) {
  CaptureConfig config;
  config.sources = read_sources(map, rig, parsed);
  if (map.has("synthetic")) config.synthetic = read_synthetic_world(map.map("synthetic"));
  if (map.has("segmentation"))
    read_segmentation(map.map("segmentation"), rig, runs_here(parsed.node.host), config);
  config.lost_camera = map.choice<LostCamera>(
      "lost_camera",
      {{"drop", LostCamera::drop}, {"wait", LostCamera::wait}, {"continue", LostCamera::go_on}},
      config.lost_camera);
  config.loop = map.flag("loop", config.loop);
  config.max_frames_in_flight =
      map.integer("max_frames_in_flight", {0, 64}, config.max_frames_in_flight);
  config.precomputed_frames =
      map.integer("precomputed_frames", {0, 100000}, config.precomputed_frames);
  return config;
}

ReconConfig read_recon(YamlMap& map) {
  ReconConfig config;
  config.backend = map.choice<HullBackend>("backend",
                                           {{"auto", HullBackend::automatic},
                                            {"cpu", HullBackend::cpu},
                                            {"gl", HullBackend::gl},
                                            {"sweep", HullBackend::sweep}},
                                           config.backend);
  config.threads = map.integer("threads", {1, 256}, config.threads);
  config.sweep_planes = map.integer("sweep_planes", {2, 4096}, config.sweep_planes);
  config.tile_columns = map.integer("tile_columns", {1, 256}, config.tile_columns);
  config.tile_rows = map.integer("tile_rows", {1, 256}, config.tile_rows);
  config.split = map.choice<ReconSplit>(
      "split", {{"tiles", ReconSplit::tiles}, {"frames", ReconSplit::frames}}, config.split);
  config.balance = map.flag("balance", config.balance);
  config.worker_index = map.integer("worker", kCount, config.worker_index);
  config.worker_count = map.integer("workers", kAtLeastOne, config.worker_count);
  if (config.worker_index >= config.worker_count)
    map.problem_at("worker", fmt::format("worker must be less than workers ({}), is {}",
                                         config.worker_count, config.worker_index));
  return config;
}

SimConfig read_sim(YamlMap& map) {
  SimConfig config;
  config.collision = map.choice<CollisionBackend>("collision",
                                                  {{"cpu", CollisionBackend::cpu},
                                                   {"gl", CollisionBackend::gl},
                                                   {"paper", CollisionBackend::paper}},
                                                  config.collision);
  config.threads = map.integer("threads", {1, 256}, config.threads);
  config.eps_m = map.number("eps_m", {1e-6, 0.1}, config.eps_m);
  config.spacing_m = map.number("spacing_m", {1e-5, 1}, config.spacing_m);
  config.viewport_px = map.integer("viewport_px", {1, 4096}, config.viewport_px);
  config.window_px = map.integer("window_px", {1, 16384}, config.window_px);
  config.step_s = map.number("step_s", {1e-4, 0.1}, config.step_s);
  config.max_points = map.integer("max_points", {1, kMaxCollisionPoints}, config.max_points);
  if (config.viewport_px > config.window_px)
    map.problem_at("viewport_px", fmt::format("viewport_px must be at most window_px ({}), is {}",
                                              config.window_px, config.viewport_px));
  return config;
}

RenderConfig read_render(YamlMap& map, const std::string& name) {
  RenderConfig config;
  config.window = map.flag("window", config.window);
  config.video = map.flag("video", config.video);
  config.still_frame = map.integer64("still_frame", kCount, config.still_frame);
  if (map.has("viewer")) config.viewer = read_spectator(map.map("viewer"), name);
  return config;
}

std::vector<int> read_cores(YamlMap& map) {
  std::vector<int> cores = map.integers("cores", kCores);
  std::vector<int> sorted = cores;
  std::sort(sorted.begin(), sorted.end());
  if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end()); twice != sorted.end())
    map.problem_at("cores", fmt::format("cores contains core {} twice", *twice));
  return cores;
}

enum class Program { unknown, capture, recon, sim, render };

}  // namespace

ParsedNode read_node(YamlMap map, const Rig& rig) {
  ParsedNode parsed;
  parsed.location = map.location();
  parsed.node.line = parsed.location.line;
  parsed.node.name = map.name("name");
  parsed.name_location = map.location_of("name");
  parsed.worker_index_location = map.location_of("worker");
  parsed.node.host = map.text("host", "");
  parsed.node.cores = read_cores(map);
  const Program program = map.choice<Program>("program",
                                              {{"capture_node", Program::capture},
                                               {"recon_node", Program::recon},
                                               {"sim_node", Program::sim},
                                               {"render_node", Program::render}},
                                              Program::unknown);
  if (!map.has("program"))
    map.problem("program is missing: set capture_node, recon_node, sim_node or render_node");
  switch (program) {
    case Program::capture: parsed.node.config = read_capture(map, rig, parsed); break;
    case Program::recon: parsed.node.config = read_recon(map); break;
    case Program::sim: parsed.node.config = read_sim(map); break;
    case Program::render: parsed.node.config = read_render(map, parsed.node.name); break;
    case Program::unknown:
      map.report_missing();
      return parsed;  // the other keys depend on the program
  }
  map.finish();
  return parsed;
}

}  // namespace fivepipe::config
