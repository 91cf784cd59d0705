// The newest SimulationMetrics of each simulation, without DDS types, and their texts. Pure.
#pragma once
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "launch/supervise/status/node_status.h"

namespace fivepipe::launch {

// The objects of one kind. A value is absent if the message does not state it for the kind.
struct SimulatedObjects {
  std::uint64_t count = 0;
  std::optional<double> kinetic_j = {}, potential_j = {};
  std::uint64_t hull_contacts = 0;
  std::optional<std::uint64_t> body_contacts = {};
  std::optional<double> in_hull_m = {}, in_body_m = {};  // the deepest penetration
};

struct SimulationStatus {
  std::string simulation;                                // the node's name
  std::map<std::string, SimulatedObjects> of_kind = {};  // "bodies", "cloths", "particles"
};

// Keeps the newest status of each simulation. Arrival stamps are of any steady clock.
class SimulationRegistry {
 public:
  // A peer can publish under any name. The registry ignores and counts further ones.
  static constexpr std::size_t kMaxSimulations = 32;

  struct Entry {
    SimulationStatus newest;
    std::int64_t arrived_ns = 0;
    // The deepest penetrations by kind, over all statuses [m].
    std::map<std::string, double> max_in_hull_m, max_in_body_m;
  };

  void add(SimulationStatus status, std::int64_t arrived_ns);
  // Counts a message that the caller cannot add.
  void ignore() { ++ignored_; }
  // Number of messages that add() or the caller ignored.
  std::uint64_t ignored() const { return ignored_; }
  const std::map<std::string, Entry>& entries() const { return entries_; }  // by name

 private:
  std::map<std::string, Entry> entries_;
  std::uint64_t ignored_ = 0;
};

// Returns the table of `fivepipe top`: a line per simulation and kind of object. Empty if no
// simulation published within kMaxSilence_s. The counts of resets are those of the node's status.
std::string simulations_table(const SimulationRegistry& simulations, const StatusRegistry& statuses,
                              std::int64_t now_ns);

// Returns the values of a simulation in report.json, by kind.
nlohmann::json json_of(const SimulationRegistry::Entry& entry);

}  // namespace fivepipe::launch
