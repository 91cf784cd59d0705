#include "common/config/deployment.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "common/base/readable_file.h"
#include "common/config/node_checks.h"
#include "common/config/node_reader.h"
#include "common/config/read_files.h"
#include "common/config/view/viewer_reader.h"
#include "common/config/yaml/yaml_reader.h"

namespace fivepipe::config {

namespace {

constexpr Range kDomains{0, kMaxDomain};

Settings read_settings(YamlMap& map, const std::map<std::string, std::string>& overrides) {
  std::map<std::string, Setting> defaults;
  SourceLocation location{1, 1};
  if (map.has("settings")) {
    YamlMap settings = map.map("settings");
    location = map.location_of("settings");
    for (const std::string& key : settings.keys())
      defaults[key] = {settings.text(key), false, settings.location_of(key)};
  }
  return Settings(map.file(), location, std::move(defaults), overrides, map.problems());
}

// Reads the file that a key names. Adds its problems to the map's.
template <typename Content>
Content read_named_file(YamlMap& map, const std::string& key,
                        Content (*read)(const std::filesystem::path&, Problems&)) {
  const std::filesystem::path file = map.path(key);
  if (file.empty()) return {};
  if (const auto why = base::why_unreadable(file)) {
    map.problem_at(key, key + ' ' + file.string() + ": " + *why);
    return {};
  }
  return read(file, map.problems());
}

// Reads `hull` into the deployment. cameras: number of cameras that give shape, if the rig is
// valid.
void read_hull(YamlMap& map, std::optional<int> cameras, Deployment& deployment) {
  hull::HullRule& rule = deployment.hull_rule;
  if (!map.has("hull")) return;
  YamlMap keys = map.map("hull");
  rule.limits = keys.choice<hull::Limits>(
      "limits", {{"all", hull::Limits::all}, {"seen", hull::Limits::seen}}, rule.limits);
  const bool has_min_seen = keys.has("min_seen");
  rule.min_seen =
      keys.integer("min_seen", {1, cameras ? double(*cameras) : kUnbounded}, rule.min_seen);
  if (has_min_seen && rule.limits == hull::Limits::all)
    keys.problem_at("min_seen", "min_seen has an effect only with limits: seen; remove it");
  if (!has_min_seen && rule.limits == hull::Limits::seen && cameras && rule.min_seen > *cameras)
    keys.problem_at("limits", fmt::format("min_seen is {} by default, but the rig has {} camera "
                                          "that gives shape: set min_seen: 1",
                                          rule.min_seen, *cameras));
  deployment.coverage = keys.flag("coverage", deployment.coverage);
  if (deployment.coverage && rule.limits == hull::Limits::seen)
    keys.problem_at("coverage", "coverage needs limits: all; remove one of the two");
  keys.finish();
}

// Copies what all nodes must agree on to the node's configuration.
void set_hull(const Deployment& deployment, NodeConfig& config) {
  std::visit(
      [&](auto& node) {
        if constexpr (requires { node.hull_rule; }) node.hull_rule = deployment.hull_rule;
        if constexpr (requires { node.coverage; }) node.coverage = deployment.coverage;
      },
      config);
}

void read_nodes(YamlMap& map, Deployment& deployment, bool rig_is_valid, bool viewer_is_valid) {
  const std::size_t problems_before = map.problem_count();
  std::vector<ParsedNode> nodes;
  for (YamlMap& node : map.maps("nodes")) nodes.push_back(read_node(node, deployment.rig));
  const SourceLocation location = map.location_of("nodes");
  check_names_and_counts(nodes, map.file(), map.problems());
  check_hosts(nodes, deployment.hosts, map.file(), map.problems());
  check_spectators(nodes, deployment.viewer, map.file(), map.problems());
  const bool nodes_are_good = map.problem_count() == problems_before;
  if (rig_is_valid) check_sources(nodes, deployment.rig, map.file(), location, map.problems());
  if (deployment.coverage) check_coverage(nodes, map.file(), map.problems());
  if (nodes_are_good && viewer_is_valid)
    check_workers(nodes, deployment.viewer, deployment.scene, map.file(), map.problems());
  for (ParsedNode& parsed : nodes) {
    set_hull(deployment, parsed.node.config);
    deployment.nodes.push_back(std::move(parsed.node));
  }
}

// Removes the cameras from the rig that `without_cameras` names.
void leave_out_cameras(YamlMap& map, Rig& rig) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const RigCamera& camera : rig.cameras) names.emplace_back(camera.name, camera.name);
  const std::size_t problems_before = map.problem_count();
  for (const auto& [name, location] : map.choices("without_cameras", names))
    rig.left_out.push_back(name);
  std::erase_if(rig.cameras, [&](const RigCamera& camera) {
    return std::ranges::count(rig.left_out, camera.name) > 0;
  });
  if (map.problem_count() == problems_before && shape_cameras(rig).empty())
    map.problem_at("without_cameras", "without_cameras leaves no camera that gives shape");
}

// The tracker divides the rig's volume into cells. Rejects more than kMaxHistoryCells.
void check_history(YamlMap& map, const Deployment& deployment) {
  if (!deployment.scene.history) return;
  const double cells =
      (deployment.rig.volume_m.sizes() / deployment.scene.history->cell_m).array().ceil().prod();
  if (cells <= kMaxHistoryCells) return;
  map.problem_at("scene",
                 fmt::format("history.cell_m of the scene splits the rig's volume_m into {:.4g} "
                             "cells, the limit is {:.4g}: increase cell_m or reduce volume_m",
                             cells, kMaxHistoryCells));
}

std::vector<std::filesystem::path> files_of(YamlMap& map, const Deployment& deployment) {
  std::vector<std::filesystem::path> files{deployment.file};
  for (const char* key : {"rig", "scene"})
    if (map.has(key)) files.push_back(map.path(key));
  const auto add_once = [&](const std::filesystem::path& file) {
    if (std::ranges::count(files, file) == 0) files.push_back(file);
  };
  for (const SceneObject& object : deployment.scene.objects)
    if (const auto* mesh = std::get_if<MeshShape>(&object.shape)) {
      files.push_back(mesh->file);
      for (const std::filesystem::path& file : mesh->files) add_once(file);
      if (!mesh->materials) continue;
      for (const Material& material : mesh->materials->materials)
        if (material.texture) add_once(material.texture->file);
    }
  if (!deployment.viewer.file.empty()) files.push_back(deployment.viewer.file);
  for (const Node& node : deployment.nodes)
    if (const Viewer* const spectator = spectator_of(node); spectator && !spectator->file.empty())
      add_once(spectator->file);
  return files;
}

Deployment read_deployment(const std::filesystem::path& file,
                           const std::map<std::string, std::string>& overrides,
                           Problems& problems) {
  YamlMap map = YamlMap::load(file, problems);
  Deployment deployment;
  deployment.file = file;
  if (map.is_void()) return deployment;
  Settings settings = read_settings(map, overrides);
  map.use_settings(settings);
  deployment.name = map.name("name");
  deployment.domain = std::uint32_t(map.integer("domain", kDomains, 0));
  deployment.hosts = read_hosts(map);
  deployment.network_profile = map.choice<std::string>(
      "network_profile", {{"loopback", "loopback"}, {"lan", "lan"}, {"lossy", "lossy"}},
      deployment.hosts.size() > 1 ? "lan" : deployment.network_profile);
  for (const char* const profile : {"lan", "lossy"})
    if (deployment.hosts.empty() && deployment.network_profile == profile)
      map.problem_at("network_profile", std::string("network_profile ") + profile +
                                            " needs `hosts`: the machines with their addresses");
  if (deployment.hosts.size() > 1 && deployment.network_profile == "loopback")
    map.problem_at("network_profile",
                   "network_profile loopback reaches no other machine: with several hosts, use lan "
                   "or lossy");
  deployment.security = read_security(map);
  deployment.frame_rate_hz = map.number("frame_rate_hz", {0, 1000, true}, deployment.frame_rate_hz);
  const std::size_t problems_before_rig = problems.count();
  deployment.rig = read_named_file(map, "rig", read_rig);
  bool rig_is_valid = map.has("rig") && problems.count() == problems_before_rig;
  if (map.has("without_cameras") && rig_is_valid) {
    leave_out_cameras(map, deployment.rig);
    rig_is_valid = problems.count() == problems_before_rig;
  }
  read_hull(map,
            rig_is_valid ? std::optional(int(shape_cameras(deployment.rig).size())) : std::nullopt,
            deployment);
  if (rig_is_valid) deployment.hull_rule.within_world_m = deployment.rig.volume_m;
  deployment.scene = read_named_file(map, "scene", read_scene);
  if (rig_is_valid) check_history(map, deployment);
  const std::size_t problems_before_viewer = problems.count();
  deployment.viewer = read_viewer(map.map("viewer"));
  const bool viewer_is_valid = problems.count() == problems_before_viewer;
  read_nodes(map, deployment, rig_is_valid, viewer_is_valid);
  deployment.files = files_of(map, deployment);
  map.finish();
  return deployment;
}

}  // namespace

Deployment load_deployment(const std::filesystem::path& file,
                           const std::map<std::string, std::string>& settings) {
  Problems problems;
  Deployment deployment = read_deployment(file, settings, problems);
  problems.throw_if_any();
  return deployment;
}

std::string program_of(const Node& node) {
  struct Name {
    std::string operator()(const CaptureConfig&) const { return "capture_node"; }
    std::string operator()(const ReconConfig&) const { return "recon_node"; }
    std::string operator()(const SimConfig&) const { return "sim_node"; }
    std::string operator()(const RenderConfig&) const { return "render_node"; }
  };
  return std::visit(Name{}, node.config);
}

const Node* find_node(const Deployment& deployment, const std::string& name) {
  for (const Node& node : deployment.nodes)
    if (node.name == name) return &node;
  return nullptr;
}

const Viewer* spectator_of(const Node& node) {
  const auto* const render = std::get_if<RenderConfig>(&node.config);
  return render && render->viewer ? &*render->viewer : nullptr;
}

std::vector<Viewer> spectators_of(const Deployment& deployment) {
  std::vector<Viewer> spectators;
  for (const Node& node : deployment.nodes)
    if (const Viewer* const spectator = spectator_of(node)) spectators.push_back(*spectator);
  return spectators;
}

bool draws_for_viewer(const Node& node) {
  return std::holds_alternative<RenderConfig>(node.config) && !spectator_of(node);
}

const Node* first_capture_node(const Deployment& deployment) {
  for (const Node& node : deployment.nodes)
    if (std::holds_alternative<CaptureConfig>(node.config)) return &node;
  return nullptr;
}

std::set<std::string> dispensable_cameras(const Deployment& deployment) {
  std::set<std::string> dispensable;
  for (const Node& node : deployment.nodes)
    if (const auto* capture = std::get_if<CaptureConfig>(&node.config);
        capture && capture->lost_camera == LostCamera::go_on)
      for (const RigCamera& camera : deployment.rig.cameras)
        if (camera.gives_shape && capture->sources.contains(camera.name))
          dispensable.insert(camera.name);
  return dispensable;
}

CaptureConfig capture_of_all_nodes(const Deployment& deployment) {
  const Node* const first = first_capture_node(deployment);
  if (!first)
    throw std::runtime_error(deployment.file.string() + ": the deployment has no capture_node");
  auto all = std::get<CaptureConfig>(first->config);
  for (const Node& node : deployment.nodes) {
    const auto* capture = std::get_if<CaptureConfig>(&node.config);
    if (!capture) continue;
    for (const auto& [camera, source] : capture->sources) {
      all.sources[camera] = source;
      all.segmentation_of.insert_or_assign(camera, capture->segmentation_for(camera));
    }
  }
  return all;
}

}  // namespace fivepipe::config
