// Conversion to the messages VirtualState, Particles and SimulationMetrics, and execution of the
// message Command.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/messages/wire_conversions.h"
#include "sim_node/simulation/simulation.h"

namespace fivepipe::sim {

// A VirtualState and the storage that it borrows. Contains only objects that move, are warmed or
// have a spacing; the receiver reads the others from the scene. message() is valid until this
// object is changed or destroyed.
struct OutgoingState {
  fivepipe_v1_VirtualState header{};
  std::vector<fivepipe_v1_ObjectState> objects;
  std::vector<std::vector<float>> vertices_m, warmth;  // one per object
  const fivepipe_v1_VirtualState& message();
};
OutgoingState state_message(const std::string& simulation, std::uint64_t frame,
                            std::int64_t capture_stamp_ns, double simulation_time_s,
                            const config::Scene& scene, const std::vector<ObjectState>& states);

// A Particles message and the storage that it borrows, as above.
struct OutgoingParticles {
  fivepipe_v1_Particles header{};
  std::vector<float> p_m;
  const fivepipe_v1_Particles& message();
};
OutgoingParticles particles_message(const std::string& source, std::uint64_t frame,
                                    std::int64_t capture_stamp_ns, const ParticleSet& particles);

// A SimulationMetrics message and the storage that it borrows, as above.
struct OutgoingMetrics {
  fivepipe_v1_SimulationMetrics header{};
  std::vector<fivepipe_v1_BodyMetrics> bodies;
  std::vector<fivepipe_v1_ClothMetrics> cloths;
  std::vector<fivepipe_v1_ParticleMetrics> particles;
  const fivepipe_v1_SimulationMetrics& message();
};
OutgoingMetrics metrics_message(const std::string& simulation, std::uint64_t frame,
                                std::int64_t capture_stamp_ns, double simulation_time_s,
                                const SimulationMetrics& metrics);

// Executes the command if its target is this node or empty.
void apply(const fivepipe_v1_Command& command, const std::string& node, Simulation& simulation);

}  // namespace fivepipe::sim
