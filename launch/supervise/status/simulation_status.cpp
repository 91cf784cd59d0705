#include "launch/supervise/status/simulation_status.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/base/text_table.h"

namespace fivepipe::launch {
namespace {

// Counts of a node's status (sim_node/simulation_pipe.cpp) by kind of object.
const std::map<std::string, std::vector<std::string>> kResets = {
    {"bodies", {"objects_respawned"}},
    {"cloths", {"cloths_reset"}},
    {"particles", {"particles_stuck", "particles_not_finite"}}};

std::uint64_t resets_of(const std::string& kind, const ProcessStatus* status) {
  std::uint64_t resets = 0;
  const auto names = kResets.find(kind);
  if (!status || names == kResets.end()) return resets;
  for (const std::string& name : names->second)
    if (const auto count = status->counts.find(name); count != status->counts.end())
      resets += count->second;
  return resets;
}

std::string energy_text(const std::optional<double>& energy_j) {
  return base::with_decimals(energy_j.value_or(std::numeric_limits<double>::quiet_NaN()), 3);
}

// Returns now/max in millimetres, such as "0.4/2.1".
std::string depth_text(const std::optional<double>& now_m, const std::string& kind,
                       const std::map<std::string, double>& max_m) {
  return now_m ? fmt::format("{:.1f}/{:.1f}", 1e3 * *now_m, 1e3 * max_m.at(kind)) : "-";
}

void take_max(std::map<std::string, double>& max_m, const std::string& kind,
              const std::optional<double>& depth_m) {
  if (depth_m) max_m[kind] = std::max(max_m[kind], *depth_m);
}

std::string ignored_text(const SimulationRegistry& simulations) {
  if (simulations.ignored() == 0) return "";
  return fmt::format("ignored {}: a value is impossible, or too many simulations\n",
                     base::counted(simulations.ignored(), "message") + " SimulationMetrics");
}

}  // namespace

void SimulationRegistry::add(SimulationStatus status, std::int64_t arrived_ns) {
  if (!entries_.contains(status.simulation) && entries_.size() >= kMaxSimulations) {
    ++ignored_;
    return;
  }
  Entry& entry = entries_[status.simulation];
  for (const auto& [kind, objects] : status.of_kind) {
    take_max(entry.max_in_hull_m, kind, objects.in_hull_m);
    take_max(entry.max_in_body_m, kind, objects.in_body_m);
  }
  entry.newest = std::move(status);
  entry.arrived_ns = arrived_ns;
}

std::string simulations_table(const SimulationRegistry& simulations, const StatusRegistry& statuses,
                              std::int64_t now_ns) {
  base::TextTable table({{.head = "simulation", .min_width = 14},
                         {.head = "objects", .min_width = 16},
                         {.head = "kinetic J", .right = true, .min_width = 9},
                         {.head = "potential J", .right = true},
                         {.head = "hull contacts", .right = true},
                         {.head = "in hull now/max mm", .right = true},
                         {.head = "object contacts", .right = true},
                         {.head = "overlap now/max mm", .right = true},
                         {.head = "resets", .right = true}});
  for (const auto& [name, entry] : simulations.entries()) {
    if (1e-9 * double(now_ns - entry.arrived_ns) > kMaxSilence_s) continue;
    for (const auto& [kind, of] : entry.newest.of_kind)
      table.add({base::printable(name), fmt::format("{}: {}", kind, of.count),
                 energy_text(of.kinetic_j), energy_text(of.potential_j),
                 std::to_string(of.hull_contacts),
                 depth_text(of.in_hull_m, kind, entry.max_in_hull_m),
                 of.body_contacts ? std::to_string(*of.body_contacts) : "-",
                 depth_text(of.in_body_m, kind, entry.max_in_body_m),
                 std::to_string(resets_of(kind, statuses.newest(name)))});
  }
  return (table.empty() ? "" : "\n" + table.text()) + ignored_text(simulations);
}

nlohmann::json json_of(const SimulationRegistry::Entry& entry) {
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [kind, of] : entry.newest.of_kind) {
    nlohmann::json& written =
        json[kind] = {{"count", of.count}, {"hull_contacts", of.hull_contacts}};
    if (of.kinetic_j) written["kinetic_j"] = *of.kinetic_j;
    if (of.potential_j) written["potential_j"] = *of.potential_j;
    if (of.body_contacts) written["object_contacts"] = *of.body_contacts;
    if (of.in_hull_m) {
      written["in_hull_mm"] = 1e3 * *of.in_hull_m;
      written["max_in_hull_mm"] = 1e3 * entry.max_in_hull_m.at(kind);
    }
    if (of.in_body_m) {
      written["overlap_mm"] = 1e3 * *of.in_body_m;
      written["max_overlap_mm"] = 1e3 * entry.max_in_body_m.at(kind);
    }
  }
  return json;
}

}  // namespace fivepipe::launch
