#include "common/config/node_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <tuple>

#include "common/config/yaml/key_suggestion.h"

namespace fivepipe::config {

namespace {

void check_cameras_exist(const ParsedNode& parsed, const Rig& rig,
                         const std::filesystem::path& file, Problems& problems) {
  std::vector<std::string> names;
  for (const RigCamera& camera : rig.cameras) names.push_back(camera.name);
  for (const auto& [camera, location] : parsed.source_locations) {
    if (std::find(names.begin(), names.end(), camera) != names.end()) continue;
    const auto nearest = nearest_word(camera, names);
    problems.add(file, location,
                 "rig " + rig.name + " has no camera " + camera +
                     (nearest ? ": did you mean " + *nearest + '?' : ""));
  }
}

// All synthetic cameras must see the same world at the same time.
void check_one_synthetic_world(const std::vector<ParsedNode>& nodes,
                               const std::filesystem::path& file, Problems& problems) {
  const SyntheticWorld* first = nullptr;
  for (const ParsedNode& parsed : nodes) {
    const auto* capture = std::get_if<CaptureConfig>(&parsed.node.config);
    if (capture == nullptr) continue;
    const bool is_synthetic = std::any_of(
        capture->sources.begin(), capture->sources.end(),
        [](const auto& source) { return std::holds_alternative<SyntheticSource>(source.second); });
    if (!is_synthetic) continue;
    const SyntheticWorld& world = capture->synthetic;
    if (first == nullptr) first = &world;
    const auto shared = [](const SyntheticWorld& w) {
      return std::tie(w.seed, w.period_s, w.cast_shadow, w.actor, w.hand_length_m, w.tool);
    };
    if (shared(world) != shared(*first))
      problems.add(file, parsed.location,
                   parsed.node.name +
                       ": seed, period_s, cast_shadow, actor, hand_length_m and tool of synthetic "
                       "must be the same in all capture nodes");
  }
}

}  // namespace

void check_sources(const std::vector<ParsedNode>& nodes, const Rig& rig,
                   const std::filesystem::path& file, SourceLocation nodes_location,
                   Problems& problems) {
  std::map<std::string, std::string> reader_of;
  bool has_capture_node = false;
  for (const ParsedNode& parsed : nodes) {
    has_capture_node =
        has_capture_node || std::holds_alternative<CaptureConfig>(parsed.node.config);
    check_cameras_exist(parsed, rig, file, problems);
    for (const auto& [camera, location] : parsed.source_locations) {
      const auto [first, is_new] = reader_of.try_emplace(camera, parsed.node.name);
      if (!is_new)
        problems.add(file, location,
                     "camera " + camera + " is already read by node " + first->second);
    }
  }
  check_one_synthetic_world(nodes, file, problems);
  // Without a capture node, a replay or the capture node of another deployment sends the maps.
  if (!has_capture_node) return;
  for (const RigCamera& camera : rig.cameras)
    if ((camera.gives_shape || camera.gives_colour) && !reader_of.contains(camera.name))
      problems.add(
          file, nodes_location,
          fmt::format("camera {} of rig {} has no source: add it to the sources of a capture node",
                      camera.name, rig.name));
}

void check_names_and_counts(const std::vector<ParsedNode>& nodes, const std::filesystem::path& file,
                            Problems& problems) {
  std::map<std::string, int> line_of_name, first_of_single_program;
  for (const ParsedNode& parsed : nodes) {
    const auto [first, is_new] = line_of_name.try_emplace(parsed.node.name, parsed.location.line);
    if (!is_new && !parsed.node.name.empty())
      problems.add(
          file, parsed.name_location,
          fmt::format("node name {} is already used in line {}", parsed.node.name, first->second));
    if (!std::holds_alternative<SimConfig>(parsed.node.config) && !draws_for_viewer(parsed.node))
      continue;
    const auto [single, is_only] =
        first_of_single_program.try_emplace(program_of(parsed.node), parsed.location.line);
    if (!is_only)
      problems.add(file, parsed.location,
                   fmt::format("a deployment has at most one {}, the first is in line {}{}",
                               single->first, single->second,
                               draws_for_viewer(parsed.node)
                                   ? "; a further one needs `viewer`: it draws for a spectator"
                                   : ""));
  }
}

void check_spectators(const std::vector<ParsedNode>& nodes, const Viewer& viewer,
                      const std::filesystem::path& file, Problems& problems) {
  for (const ParsedNode& parsed : nodes)
    if (spectator_of(parsed.node) && parsed.node.name == viewer.name)
      problems.add(file, parsed.name_location,
                   "node " + parsed.node.name +
                       " draws for a spectator, so that its name cannot be that of the viewer");
}

void check_hosts(const std::vector<ParsedNode>& nodes, const std::vector<Host>& hosts,
                 const std::filesystem::path& file, Problems& problems) {
  if (hosts.empty()) return;
  std::vector<std::string> names;
  for (const Host& host : hosts) names.push_back(host.name);
  for (const ParsedNode& parsed : nodes) {
    const std::string& host = parsed.node.host;
    if (std::find(names.begin(), names.end(), host) != names.end()) continue;
    const auto nearest = nearest_word(host, names);
    problems.add(file, parsed.location,
                 host.empty() ? parsed.node.name + " names no host: add host: NAME, one of " +
                                    fmt::format("{}", fmt::join(names, ", "))
                              : "hosts has no " + host +
                                    (nearest ? ": did you mean " + *nearest + '?' : ""));
  }
}

void check_coverage(const std::vector<ParsedNode>& nodes, const std::filesystem::path& file,
                    Problems& problems) {
  for (const ParsedNode& parsed : nodes)
    if (const auto* recon = std::get_if<ReconConfig>(&parsed.node.config);
        recon != nullptr && recon->backend != HullBackend::cpu &&
        recon->backend != HullBackend::automatic)
      problems.add(file, parsed.location,
                   parsed.node.name + ": hull coverage needs backend: cpu (or auto)");
}

void check_workers(const std::vector<ParsedNode>& nodes, const Viewer& viewer, const Scene& scene,
                   const std::filesystem::path& file, Problems& problems) {
  const ReconConfig* first = nullptr;
  SourceLocation first_location;
  std::map<int, std::string> owner_of_worker;
  for (const ParsedNode& parsed : nodes) {
    const auto* recon = std::get_if<ReconConfig>(&parsed.node.config);
    if (recon == nullptr) continue;
    if (first == nullptr) {
      first = recon;
      first_location = parsed.location;
    }
    if (std::tie(recon->tile_columns, recon->tile_rows, recon->worker_count, recon->split,
                 recon->balance) != std::tie(first->tile_columns, first->tile_rows,
                                             first->worker_count, first->split, first->balance)) {
      problems.add(file, parsed.location,
                   parsed.node.name +
                       ": tile_columns, tile_rows, workers, split and balance must be the same in "
                       "all reconstruction nodes");
      return;
    }
    const auto [owner, is_new] = owner_of_worker.try_emplace(recon->worker_index, parsed.node.name);
    if (!is_new)
      problems.add(file, parsed.worker_index_location,
                   fmt::format("worker {} is already node {}", recon->worker_index, owner->second));
  }
  if (first == nullptr) return;
  const auto check_size = [&](int width_px, int height_px, const std::string& key) {
    if (first->tile_columns > width_px || first->tile_rows > height_px)
      problems.add(file, first_location,
                   fmt::format("more tiles ({} x {}) than pixels ({} x {}): reduce tile_columns or "
                               "tile_rows, or increase {}",
                               first->tile_columns, first->tile_rows, width_px, height_px, key));
  };
  const auto eyes = [](const Viewer& of) { return of.eye_distance_m ? 2 : 1; };
  int views = eyes(viewer) + (scene.shadows ? 1 : 0);
  check_size(viewer.recon_width_px, viewer.recon_height_px, "recon_size_px");
  for (const ParsedNode& parsed : nodes)
    if (const Viewer* const spectator = spectator_of(parsed.node)) {
      check_size(spectator->recon_width_px, spectator->recon_height_px,
                 "recon_size_px of " + parsed.node.name);
      views += eyes(*spectator);
    }
  if (scene.shadows)
    check_size(scene.shadows->hull_size_px[0], scene.shadows->hull_size_px[1],
               "hull_size_px of the scene's shadows");
  const int tiles = first->tile_columns * first->tile_rows;
  if (tiles * views > kMaxTilesPerFrame)
    problems.add(file, first_location,
                 fmt::format("{} x {} tiles in each of {} are {}, a frame may have {}: reduce "
                             "tile_columns or tile_rows",
                             first->tile_columns, first->tile_rows,
                             views == 1 ? "1 view" : fmt::format("{} views", views), tiles * views,
                             kMaxTilesPerFrame));
  if (first->worker_count > first->tile_columns + first->tile_rows - 1)
    problems.add(
        file, first_location,
        fmt::format(
            "workers must be at most tile_columns + tile_rows - 1 = {}, is {}: more workers "
            "would own no tile",
            first->tile_columns + first->tile_rows - 1, first->worker_count));
  else
    for (int worker = 0; worker < first->worker_count; ++worker)
      if (!owner_of_worker.contains(worker))
        problems.add(file, first_location,
                     fmt::format("workers is {}, but no reconstruction node has worker {}",
                                 first->worker_count, worker));
}

}  // namespace fivepipe::config
